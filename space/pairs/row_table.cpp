#include "space/pairs/row_table.h"

#include <algorithm>
#include <new>

#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region writing("rows: pairs");

// A block begins with where the two before it end: one is prefetched while another is read.
constexpr std::size_t block_words = row_block_bytes / sizeof(std::uint64_t);
constexpr std::size_t block_head = 2, block_pairs_held = block_words - block_head;

// Chunks of one frame: so many lines that are written to stay in the cache nearest to a thread.
constexpr std::size_t most_chunks = 256;
constexpr int least_chunk_bits = 9;  // fixed: slots of a chunk, enough for one thread
constexpr std::size_t most_row_pairs = ~std::uint32_t{0};  // of a chunk, as rows end at words
// Round numbers: one in so many slots is few; blocks, 32 kB, that a thread gets at a time.
constexpr std::size_t few_share = 8, row_storage_blocks = 64;

}  // namespace

std::uint64_t* RowTable::Blocks::addBlock(std::size_t chunk) {
  if (room == 0) {
    if (storage_used == storage.size()) storage.emplace_back();
    storage[storage_used].resizeDiscarding(row_storage_blocks * block_words + block_words);
    ++storage_used;
    room = row_storage_blocks;
  }
  // Blocks are taken from the end of the storage, which need not be aligned.
  std::uint64_t* const storage_end = storage[storage_used - 1].end();
  std::uint64_t* const end =
      storage_end - reinterpret_cast<std::uintptr_t>(storage_end) % row_block_bytes / 8;
  std::uint64_t* const block = end - room-- * block_words;
  const std::uint64_t* const before = ends[chunk];  // full
  block[0] = reinterpret_cast<std::uintptr_t>(before);
  block[1] = before ? before[-static_cast<std::ptrdiff_t>(block_words)] : 0;
  ++block_counts[chunk];
  return block + block_head;
}

std::size_t RowTable::Blocks::pairsOf(std::size_t chunk) const {
  if (block_counts[chunk] == 0) return 0;
  const std::size_t last = reinterpret_cast<std::uintptr_t>(ends[chunk] - 1) % row_block_bytes / 8;
  return (block_counts[chunk] - 1) * block_pairs_held + last + 1 - block_head;
}

template <class Use>
void RowTable::Blocks::forPairs(std::size_t chunk, Use use) const {
  for (const std::uint64_t* end = ends[chunk]; end;) {
    const std::size_t last = reinterpret_cast<std::uintptr_t>(end - 1) % row_block_bytes / 8;
    const std::uint64_t *const block = end - 1 - last, *const pairs = block + block_head,
                               *const middle = pairs + (last + 1 - block_head) / 2;
    const std::uint64_t* const ahead = reinterpret_cast<const std::uint64_t*>(block[1]);
    for (std::size_t i = 0; ahead && i < block_words; i += 8) prefetch(ahead - block_words + i);
    // Pairs side by side often have the same slot, for which a processor would wait.
    for (std::ptrdiff_t i = 0; i < middle - pairs; ++i) {
      use(pairs[i]);
      use(middle[i]);
    }
    if (end - middle > middle - pairs) use(end[-1]);
    end = reinterpret_cast<const std::uint64_t*>(block[0]);
  }
}

void RowTable::start(std::size_t slots, int threads) {
  slots_ = slots;
  chunk_bits_ = least_chunk_bits;
  while (slots >> chunk_bits_ >= most_chunks) ++chunk_bits_;
  const std::size_t chunks = (slots >> chunk_bits_) + 1;
  for (std::size_t thread = 0; thread < static_cast<std::size_t>(threads); ++thread) {
    if (thread == blocks_.size()) blocks_.push_back(std::make_unique<Blocks>());
    Blocks& blocks = *blocks_[thread];
    blocks.chunk_bits = chunk_bits_;
    blocks.ends.resizeDiscarding(chunks);
    std::fill(blocks.ends.begin(), blocks.ends.end(), nullptr);
    blocks.block_counts.resizeDiscarding(chunks);
    std::fill(blocks.block_counts.begin(), blocks.block_counts.end(), 0);
    blocks.next = blocks.ends.data();
    blocks.storage_used = blocks.room = 0;
  }
}

// Returns whether a pair may be borderline.
bool RowTable::writeChunk(std::size_t chunk, bool exact, int threads, Blocks& blocks, Pair* begin,
                          Pair* end) {
  const std::size_t first = chunk << chunk_bits_;
  const std::size_t slots = std::min(std::size_t{1} << chunk_bits_, slots_ - first);
  const auto forPairs = [&](auto use) {
    for (int thread = 0; thread < threads; ++thread) blocks_[thread]->forPairs(chunk, use);
  };
  if (few_share * static_cast<std::size_t>(end - begin) < slots) {  // sorted by comparisons
    const Pair mark = exact ? 0 : 1;
    Pair any = 0, *to = begin;
    forPairs([&](std::uint64_t pair) {
      any |= pair & mark;
      *to++ = pair >> 33 << 32 | (pair & 0xffffffff) >> 1 | (pair & mark) << 63;
    });
    std::sort(begin, end, [](Pair a, Pair b) { return a << 1 < b << 1; });
    return any;
  }
  blocks.row_ends.resizeDiscarding(slots + 1);
  std::uint32_t* const ends = blocks.row_ends.data();  // until rows are filled, where they begin
  std::fill_n(ends, slots + 1, 0);
  forPairs([&](std::uint64_t pair) { ++ends[(pair >> 33) - first + 1]; });
  const std::uint32_t longest = *std::max_element(ends, ends + slots + 1);
  for (std::size_t i = 0; i < slots; ++i) ends[i + 1] += ends[i];
  if (static_cast<std::size_t>(end - begin) > most_row_pairs) throw std::bad_alloc();
  const std::size_t count = end - begin + group_size;
  blocks.words.resizeDiscarding(count + longest + group_size);
  std::uint32_t* const words = blocks.words.data();
  std::fill_n(words + (end - begin), group_size, 0);
  forPairs([&](std::uint64_t pair) {
    words[ends[(pair >> 33) - first]++] = static_cast<std::uint32_t>(pair);
  });
  return kernelSet().writeRows({words, ends, first, slots, words + count}, exact, begin, end);
}

int RowTable::writePairs(bool exact, int threads, const PairTest* test, PairList& pairs) {
  const std::size_t chunks = (slots_ + (std::size_t{1} << chunk_bits_) - 1) >> chunk_bits_;
  chunk_begin_.resizeDiscarding(chunks + 1);
  std::size_t count = 0;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    chunk_begin_[chunk] = count;
    for (int thread = 0; thread < threads; ++thread) count += blocks_[thread]->pairsOf(chunk);
  }
  chunk_begin_[chunks] = count;
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(count);
  Pair* const written = pairs.parts[0].data();
  chunks_.resizeDiscarding(chunks);
  const int team = teamFor(count, grains::moved_pairs, threads);
  const int used = runChunks(
      writing, team, chunks, 1,
      [&](const Range& range, int thread) {
        Pair* const begin = written + chunk_begin_[range.begin];
        Pair* const end = written + chunk_begin_[range.begin + 1];
        const bool marked =
            begin < end && writeChunk(range.begin, exact, threads, *blocks_[thread], begin, end);
        const bool is_open = test && (marked || test->everyPair());
        chunks_[range.begin] = {begin, is_open ? test->keep(begin, end) : end, test || !marked};
      },
      team);
  for (const PairList::Run& chunk : chunks_) pairs.add(chunk);
  return used;
}

}  // namespace ode_parallel_sap
