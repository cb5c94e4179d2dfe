// Pairs of boxes, found cell by cell and put in order by rows. Internal linkage (kernels_impl.h).
#pragma once

#include <string.h>

#include "space/base/platform.h"
#include "space/simd/kernel_cells.h"

namespace {

// Cells that may meet those below a node.
template <class Real>
struct NearCells {
  static constexpr std::size_t most = 512, stride = most + group_size;  // fixed: 20 kB of floats

  alignas(64) Real bounds[6][stride];  // lower, upper
  alignas(64) std::uint32_t cell[stride];
  alignas(64) std::uint32_t chosen[stride];
  std::size_t count = 0;

  bool isFull() const { return count > most - group_size; }
  // Adds those in `mask` of the sixteen cells that a node has the bounds of.
  void add(const Group<Real>& node, std::uint32_t first_cell, unsigned mask) {
    Lanes::compress<6>(node.lower[0], group_size, mask, bounds[0] + count, stride);
    count += Lanes::writeNumbers(first_cell, mask, cell + count);
  }
  // Leaves in `chosen` the places of those from cell `first` on that overlap box `lane` of `box`;
  // returns their number.
  std::size_t choose(const Group<Real>& box, unsigned lane, std::uint32_t first) {
    for (int i = 0; i < group_size; ++i)
      bounds[0][count + i] = static_cast<Real>(__builtin_nanf(""));
    std::size_t number = 0;
    for (std::size_t at = 0; at < count; at += group_size) {
      const unsigned mask =
          Sixteen<Real>{bounds[0] + at, bounds[3] + at, stride}.overlapping(box, lane) &
          ~Lanes::below(cell + at, first);
      number += Lanes::writeNumbers(static_cast<std::uint32_t>(at), mask, chosen + number);
    }
    return number;
  }
};

// Cells that meet boxes near them. A processor cannot predict how many boxes one meets, so all that
// are to be met are listed before one is, and all hits before one goes to its chunk: it is wrong
// once for many.
template <bool filtered, class Real>
struct CellMeeting {
  static constexpr std::size_t most = 1024;  // fixed: 8 kB
  // Of both halves of meetings().
  static constexpr std::uint32_t both = 0x10001;
  // Whether the boxes of a cell meet each other turned, not as listed ones.
  static constexpr bool turns = !filtered && sizeof(Real) == sizeof(float);

  const Group<Real>* const cells;  // of all trees
  const GroupFilter* const filters;
  RowBlocks& blocks;
  std::size_t count = 0;
  std::uint32_t codes[most + group_size];  // sixteen times the cell, plus the lane
  std::uint32_t masks[most + group_size];  // of hits

  CellMeeting(const Group<Real>* cells, const GroupFilter* filters, RowBlocks& blocks)
      : cells(cells), filters(filters), blocks(blocks) {}

  void list(std::size_t cell, std::size_t near, unsigned mask) {
    const auto first = static_cast<std::uint32_t>(near * group_size);
    count += Lanes::writeNumbers(first, mask, codes + count);
    if (count > most - group_size) meet(cell);
  }
  // All that are listed meet the boxes of a cell, its own boxes those of lower lanes. For all that
  // a compiler knows, words that are written could change any member.
  void meet(std::size_t cell) {
    const Group<Real>* const groups = cells;
    const GroupFilter* const bits = filters;
    const std::size_t listed = count;
    std::size_t met = 0;
    for (std::size_t i = 0; i < listed; ++i) {
      const std::uint32_t near = codes[i] / group_size, lane = codes[i] % group_size;
      std::uint32_t mask = meetings(groups[near], lane, groups[cell]);
      if (near == cell) mask &= ((1u << lane) - 1) * both;
      if (filtered && mask) mask &= passesFilter(bits[near], lane, bits[cell]) * both;
      masks[met] = mask;
      codes[met] = 2 * groups[near].slot[lane];
      met += mask != 0;
    }
    count = 0;
    passOn(groups[cell], met, [this](std::size_t i, unsigned) { return codes[i]; });
  }
  // The boxes of a cell meet those 1 to 8 lanes further on, all at once.
  void meetEachOther(std::size_t cell) {
    const Group<Real>& boxes = cells[cell];
    alignas(64) Real bounds[6][2 * group_size];
    for (int axis = 0; axis < 3; ++axis)
      for (const int at : {0, group_size}) {
        memcpy(bounds[axis] + at, boxes.lower[axis], sizeof boxes.lower[axis]);
        memcpy(bounds[3 + axis] + at, boxes.upper[axis], sizeof boxes.upper[axis]);
      }
    std::size_t met = 0;
    for (unsigned by = 1; by <= group_size / 2; ++by) {
      masks[met] = Lanes::meetings(
          boxes, [&](int axis, int i) { return Lanes::further(bounds[axis] + i, by); },
          [&](int axis, int i) { return Lanes::further(bounds[3 + axis] + i, by); });
      if (by == group_size / 2) masks[met] &= 0xff * both;
      codes[met] = by;
      met += masks[met] != 0;
    }
    passOn(boxes, met, [&](std::size_t i, unsigned bit) {
      return 2 * boxes.slot[(bit + codes[i]) % group_size];
    });
  }
  // Puts pairs of boxes of a cell and others, by masks, into the chunks of the earlier slots.
  template <class Other>
  void passOn(const Group<Real>& boxes, std::size_t met, Other other) {
    const int shift = blocks.chunk_bits + 33;
    std::uint64_t** const next = blocks.next;
    std::uint64_t words[2 * group_size];
    for (int i = 0; i < group_size; ++i) {
      words[i] = std::uint64_t{boxes.slot[i]} << 33;
      words[group_size + i] = words[i] | std::uint64_t{1} << 32 | 1;
    }
    forBits(masks, met, [&](std::size_t i, unsigned bit) {
      const std::uint64_t pair = words[bit] | other(i, bit), turned = pair >> 32 | pair << 32;
      const std::uint64_t least = pair < turned ? pair : turned;
      std::uint64_t* to = next[least >> shift];
      if (reinterpret_cast<std::uintptr_t>(to) % row_block_bytes == 0)
        to = blocks.addBlock(least >> shift);
      *to = least;
      next[least >> shift] = to + 1;
    });
  }
};

// Trees are walked once for all cells below a node. Each of them chooses among what was found.
template <bool filtered, class Real>
void findPairsOf(const PairSearch<Real>& search, RowBlocks& blocks) {
  const TreeView<Real>& own = search.trees[search.own];
  const std::size_t first_cell = own.first_cell;
  NearCells<Real> near;
  CellMeeting<filtered, Real> meeting(own.levels[0] - first_cell,
                                      filtered ? own.filters - first_cell : nullptr, blocks);
  for (std::size_t begin = search.begin, end; begin < search.end; begin = end) {
    const std::size_t node = begin / group_size, node_end = (node + 1) * group_size;
    end = node_end < search.end ? node_end : search.end;
    const Group<Real>& bounds = own.levels[1][node];
    const auto meetNear = [&] {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t cell = first_cell + i;
        const std::size_t chosen =
            near.choose(bounds, i % group_size, static_cast<std::uint32_t>(cell + meeting.turns));
        for (std::size_t k = 0; k < chosen; ++k) {
          const std::size_t other = near.cell[near.chosen[k]];
          meeting.list(cell, other,
                       sixteenOf(meeting.cells[other]).overlapping(bounds, i % group_size));
        }
        meeting.meet(cell);
      }
      near.count = 0;
    };
    if constexpr (meeting.turns)
      for (std::size_t i = begin; i < end; ++i) meeting.meetEachOther(first_cell + i);
    // Of all cells below the node.
    Group<Real> all;
    for (int axis = 0; axis < 3; ++axis) {
      all.lower[axis][0] = Lanes::outermost<false>(bounds.lower[axis]);
      all.upper[axis][0] = Lanes::outermost<true>(bounds.upper[axis]);
    }
    for (std::size_t i = search.own; i < search.tree_count; ++i) {
      const TreeView<Real>& tree = search.trees[i];
      if (tree.depth == 0) continue;
      forOverlappingNodes(
          tree, all, 0, i == search.own ? begin : 0, [&](std::uint32_t group, unsigned mask) {
            near.add(tree.levels[1][group], tree.first_cell + group * group_size, mask);
            if (near.isFull()) meetNear();
          });
    }
    meetNear();
  }
}

template <class Real>
void findPairs(const PairSearch<Real>& search, RowBlocks& blocks) {
  (search.trees[search.own].filters ? findPairsOf<true, Real> : findPairsOf<false, Real>)(search,
                                                                                          blocks);
}

// Sorting networks on words in vectors of four: two vectors hold words to compare side by side, and
// are shuffled to the next partners. SSE2 compares floats only: words are made floats of 2 and
// more, which has room for half a billion slots.
struct FewWords {
#if defined(__SSE2__) && !defined(__SSE4_1__)
  using Four = FourOf<float>::Type;
  static constexpr std::uint32_t one = 0x40000000, greatest = 0x7f7ffffe;
#else
  using Four = FourOf<std::uint32_t>::Type;
  static constexpr std::uint32_t one = 0, greatest = 0xfffffffe;
#endif
  using Words = FourOf<std::uint32_t>::Type;

  // The words from `first` on, and the greatest unmarked one in place of those beyond `count`.
  static Four read(const std::uint32_t* row, int first, int count) {
    Words words;
    memcpy(&words, row + first, sizeof words);
    const FourOf<std::int32_t>::Type lanes = {0, 1, 2, 3};
    const Four four = Four(words | one), least = Four(Words(lanes + first > count - 1) & greatest);
    return four > least ? four : least;
  }
  static Four read(const std::uint32_t* row) {
    Words words;
    memcpy(&words, row, sizeof words);
    return Four(words | one);
  }
  static void write(const Four& four, std::uint32_t* to) {
    const Words words = Words(four) & ~one;
    memcpy(to, &words, sizeof words);
  }
  static void order(Four& a, Four& b) {
    const Four greater = a > b ? a : b;
    a = a < b ? a : b;
    b = greater;
  }
  // Of eight words that rise and then fall, the middle two of each four swapped.
  static void merge(Four& a, Four& b) {
    Four low, high;
    order(a, b);
    pick<0, 2, 4, 6>(a, b, &low);
    pick<1, 3, 5, 7>(a, b, &high);
    order(low, high);
    pick<0, 2, 4, 6>(low, high, &a);
    pick<1, 3, 5, 7>(low, high, &b);
    order(a, b);
    pick<0, 4, 1, 5>(a, b, &low);
    pick<2, 6, 3, 7>(a, b, &high);
    pick<0, 1, 4, 5>(low, high, &a);
    pick<2, 3, 6, 7>(low, high, &b);
  }
  // Of any: runs of two, four and eight.
  static void sort(Four& a, Four& b) {
    Four low, high;
    order(a, b);
    pick<0, 2, 4, 6>(a, b, &low);
    pick<5, 7, 1, 3>(a, b, &high);
    order(low, high);
    pick<0, 1, 4, 5>(low, high, &a);
    pick<2, 3, 6, 7>(low, high, &b);
    order(a, b);
    pick<0, 2, 4, 6>(a, b, &low);
    pick<7, 5, 3, 1>(a, b, &b);
    a = low;
    merge(a, b);
  }
};

// Sorts up to sixteen words into `to`. Sixteen are read, and eight written, or sixteen of more.
inline void orderFew(const std::uint32_t* row, int count, std::uint32_t* to) {
  using Few = FewWords;
  Few::Four a = Few::read(row, 0, count), b = Few::read(row, 4, count);
  Few::sort(a, b);
  if (__builtin_expect(count > 8, false)) {
    Few::Four c = Few::read(row, 8, count), d = Few::read(row, 12, count);
    Few::sort(c, d);
    pick<0, 2, 1, 3>(a, a, &a);
    pick<0, 2, 1, 3>(b, b, &b);
    pick<3, 1, 2, 0>(c, c, &c);
    pick<3, 1, 2, 0>(d, d, &d);
    Few::order(a, d);
    Few::order(b, c);
    Few::merge(a, b);
    Few::merge(d, c);
    Few::write(d, to + 8);
    Few::write(c, to + 12);
  }
  Few::write(a, to);
  Few::write(b, to + 4);
}

// Merges two runs of so many words, sixteen or a multiple by a power of two.
inline void mergeRuns(std::uint32_t* words, int run) {
  using Few = FewWords;
  for (int i = 0; i < run; i += 4) {
    Few::Four a = Few::read(words + i), b = Few::read(words + 2 * run - 4 - i);
    pick<3, 2, 1, 0>(b, b, &b);
    Few::order(a, b);
    pick<3, 2, 1, 0>(b, b, &b);
    Few::write(a, words + i);
    Few::write(b, words + 2 * run - 4 - i);
  }
  // Each half rises and falls, in one order or the other, and so do its halves then.
  for (int half = run / 2; half >= 8; half /= 2)
    for (int i = 0; i < 2 * run; i += 4) {
      if (i & half) continue;
      Few::Four a = Few::read(words + i), b = Few::read(words + i + half);
      Few::order(a, b);
      Few::write(a, words + i);
      Few::write(b, words + i + half);
    }
  for (int i = 0; i < 2 * run; i += 8) {
    Few::Four a = Few::read(words + i), b = Few::read(words + i + 4);
    pick<0, 2, 1, 3>(a, a, &a);
    pick<0, 2, 1, 3>(b, b, &b);
    Few::merge(a, b);
    Few::write(a, words + i);
    Few::write(b, words + i + 4);
  }
}

constexpr std::size_t some_words = 64;  // fixed: digits are as fast for longer rows

// Sorts seventeen to 64 words into `to`, where 64 are written. Up to sixteen more are read.
inline void orderSome(const std::uint32_t* row, int count, std::uint32_t* to) {
  for (std::size_t i = 0; i < some_words; ++i) to[i] = FewWords::greatest & ~FewWords::one;
  for (int i = 0; i < count; i += group_size) orderFew(row + i, count - i, to + i);
  for (int run = group_size; run < count; run *= 2)
    for (int i = 0; i < count; i += 2 * run) mergeRuns(to + i, run);
}

// Sorts words by digits of eight bits at most. Returns where they are, in `row` or `room`.
inline std::uint32_t* orderMany(std::uint32_t* row, std::size_t count, std::uint32_t* room) {
  std::uint32_t all = 0;
  for (std::size_t i = 0; i < count; ++i) all |= row[i];
  int bits = 1;
  while (std::uint64_t{all} >> bits) ++bits;
  const int passes = (bits + 7) / 8, digit_bits = (bits + passes - 1) / passes;
  const std::uint32_t digits = 1u << digit_bits;
  std::uint32_t begins[4][256];
  for (int pass = 0; pass < passes; ++pass) memset(begins[pass], 0, digits * sizeof(std::uint32_t));
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t word = row[i];
    for (int pass = 0; pass < passes; ++pass, word >>= digit_bits)
      ++begins[pass][word & (digits - 1)];
  }
  std::uint32_t *from = row, *to = room;
  for (int pass = 0; pass < passes; ++pass) {
    std::uint32_t* const next = begins[pass];
    std::uint32_t place = 0;
    for (std::uint32_t digit = 0; digit < digits; ++digit) {
      const std::uint32_t begin = place;
      place += next[digit];
      next[digit] = begin;
    }
    for (std::size_t i = 0; i < count; ++i)
      to[next[from[i] >> pass * digit_bits & (digits - 1)]++] = from[i];
    std::uint32_t* const dealt = to;
    to = from;
    from = dealt;
  }
  return from;
}

// Writes eight pairs at a time. What is beyond a row's end is overwritten by the next row.
bool writeRows(const RowChunk& chunk, bool exact, std::uint64_t* pairs, std::uint64_t* pairs_end) {
  using Words = FourOf<std::uint32_t>::Type;
  constexpr std::size_t step = 8;
  const RowChunk rows = chunk;  // what is written could change any other
  const std::uint32_t mark = exact ? 0 : 1;
  alignas(64) std::uint32_t few[group_size] = {}, some[some_words];
  Words any{};
  std::uint32_t* row = rows.words;
  for (std::size_t i = 0; i < rows.slots; ++i) {
    const std::size_t count = rows.words + rows.ends[i] - row;
    if (count == 0) continue;
    const std::uint32_t* ordered = few;
    if (count <= group_size) {
      orderFew(row, static_cast<int>(count), few);
    } else if (count <= some_words) {
      orderSome(row, static_cast<int>(count), some);
      ordered = some;
    } else {
      ordered = orderMany(row, count, rows.room);
      if (ordered == rows.room) memset(rows.room + count, 0, step * sizeof *rows.room);
    }
    row += count;
    const std::uint32_t earlier = static_cast<std::uint32_t>(rows.first + i);
    for (std::size_t k = 0; k < count; k += step) {
      const std::size_t room = static_cast<std::size_t>(pairs_end - (pairs + k));
      std::uint64_t last[step], *const out =
                                    __builtin_expect(room >= step, true) ? pairs + k : last;
      for (std::size_t four = 0; four < step; four += 4) {
        Words words;
        memcpy(&words, ordered + k + four, sizeof words);
        any |= words;  // of the chunk, if beyond the row
        const Words later = words >> 1, high = (words & mark) << 31 | earlier;
        pick<0, 4, 1, 5>(later, high, out + four);
        pick<2, 6, 3, 7>(later, high, out + four + 2);
      }
      if (out == last) memcpy(pairs + k, last, room * sizeof *pairs);
    }
    pairs += count;
  }
  return ((any[0] | any[1] | any[2] | any[3]) & mark) != 0;
}

}  // namespace
