#include "space/pairs/row_table.h"

#include <algorithm>

#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region clearing("rows: table"), writing("rows: pairs");

constexpr std::size_t chunksOf(std::size_t slots) {
  return (slots + row_chunk - 1) / row_chunk;
}

}  // namespace

template <class Real>
void RowTable<Real>::Space::start(std::size_t slots, Row* table) {
  this->rows = table;
  blocks_used = 0;
  this->next = this->end = nullptr;
  pair_counts.resizeDiscarding(chunksOf(slots));
  std::fill(pair_counts.begin(), pair_counts.end(), 0);
  this->counts = pair_counts.data();
  const std::size_t words = slots / 64 + 1, marks = words + words / 64 + 1;
  if (slot_marks.size() < marks) {
    slot_marks.resizeDiscarding(marks);
    std::fill(slot_marks.begin(), slot_marks.end(), 0);
  }
  this->marks = slot_marks.data();
  this->marked_words = this->marks + words;
}

template <class Real>
void RowTable<Real>::Space::growNear(std::size_t cells) {
  const std::size_t before = this->stride;
  const std::size_t stride = groupsFor(cells + cells / 2) * group_size;
  Buffer<Real> bounds;
  Buffer<std::uint32_t> numbers;
  bounds.resize(6 * stride);
  numbers.resize(3 * stride);
  for (std::size_t i = 0; i < 6 && before; ++i)
    std::copy_n(near_bounds.data() + i * before, before, bounds.data() + i * stride);
  for (std::size_t i = 0; i < 2 && before; ++i)
    std::copy_n(near_numbers.data() + i * before, before, numbers.data() + i * stride);
  near_bounds.swap(bounds);
  near_numbers.swap(numbers);
  this->bounds = near_bounds.data();
  this->cell = near_numbers.data();
  this->greatest = this->cell + stride;
  this->chosen = this->greatest + stride;
  this->stride = stride;
}

template <class Real>
void RowTable<Real>::Space::growWords(std::size_t words) {
  scratch.resizeDiscarding(words + words / 2);
  this->words = scratch.data();
  this->word_room = scratch.size();
}

// Rows that are there stay where they are.
template <class Real>
void RowTable<Real>::Space::growRows(std::size_t words) {
  if (blocks_used == blocks.size()) blocks.emplace_back();
  Buffer<std::uint32_t>& block = blocks[blocks_used];
  block.resizeDiscarding(std::max(words, row_block_words));
  ++blocks_used;
  this->next = block.data();
  this->end = block.end();
}

template <class Real>
void RowTable<Real>::start(std::size_t slots, int threads) {
  while (spaces_.size() < static_cast<std::size_t>(threads))
    spaces_.push_back(std::make_unique<Space>());
  rows_.resizeDiscarding(slots);
  for (int thread = 0; thread < threads; ++thread) spaces_[thread]->start(slots, rows_.data());
  runTeam(clearing, teamFor(slots, grains::sorted_records, threads), [&](int thread, int team) {
    const Range own = ownPart(slots, thread, team);
    std::fill(rows_.begin() + own.begin, rows_.begin() + own.end, nullptr);
  });
}

template <class Real>
int RowTable<Real>::writePairs(bool exact, int threads, const PairTest* test, PairList& pairs) {
  const std::size_t slots = rows_.size(), chunks = chunksOf(slots);
  chunk_begin_.resizeDiscarding(chunks + 1);
  std::size_t count = 0;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    chunk_begin_[chunk] = count;
    for (int thread = 0; thread < threads; ++thread) count += spaces_[thread]->pair_counts[chunk];
  }
  chunk_begin_[chunks] = count;
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(count);
  Pair* const written = pairs.parts[0].data();
  chunks_.resizeDiscarding(chunks);
  const int team = teamFor(count + slots, grains::sorted_records, threads);
  const int used = runChunks(
      writing, team, chunks, 1,
      [&](const Range& range, int) {
        const std::size_t first = range.begin * row_chunk;
        const std::size_t last = std::min(first + row_chunk, slots);
        Pair* const begin = written + chunk_begin_[range.begin];
        Pair* const end = written + chunk_begin_[range.begin + 1];
        const bool marked = kernelSet().writeRows(rows_.data(), first, last, exact, begin, end);
        const bool is_open = test && (marked || test->everyPair());
        chunks_[range.begin] = {begin, is_open ? test->keep(begin, end) : end, test || !marked};
      },
      team);
  for (const PairList::Run& chunk : chunks_) pairs.add(chunk);
  return used;
}

template class RowTable<float>;
template class RowTable<double>;

}  // namespace ode_parallel_sap
