#include "space/pairs/cell_order.h"

#include <cmath>
#include <optional>
#include <utility>

#include "space/base/both_sides.h"
#include "space/base/mechanisms.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

static Region splitting("cell order: sample"), assigning("cell order: regions"),
    dealing("cell order: centres"), halving("cell order: halves");

// A round number: boxes of a region that one thread halves at a time, on average up to so many.
constexpr std::size_t region_boxes = 512;

// Boxes that decide on classes. 1,024 show a kind of box that is one in a few hundred. Where 1,000
// jump, frames with a quarter of them have 0.78 of the instructions of frames with all. Round
// numbers.
constexpr std::size_t sampledBoxes(std::size_t boxes) {
  return std::clamp<std::size_t>(boxes / 4, 256, 1024);
}

namespace {

// How far centres lie apart: the axis on which they lie farthest, and the mean of all axes.
struct Spread {
  std::uint32_t widest;
  float mean;
};

// Needs at least one centre.
Spread spreadOf(const Centre* begin, const Centre* end) {
  float low[3], high[3], length[3];
  for (int axis = 0; axis < 3; ++axis) low[axis] = high[axis] = begin->at[axis];
  for (const Centre* centre = begin; centre < end; ++centre)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], centre->at[axis]);
      high[axis] = std::max(high[axis], centre->at[axis]);
    }
  for (int axis = 0; axis < 3; ++axis) length[axis] = high[axis] - low[axis];
  std::uint32_t widest = 0;
  for (std::uint32_t axis = 1; axis < 3; ++axis)
    if (length[axis] > length[widest]) widest = axis;
  return {widest, (length[0] + length[1] + length[2]) / 3};
}

// Returns the middle.
Centre* sortByHalves(Centre* begin, Centre* end, std::uint32_t axis) {
  Centre* const middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end, [=](const Centre& a, const Centre& b) {
    return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.slot < b.slot;
  });
  return middle;
}

// The lower quartile of the spreads of parts, which end where the next ones begin: a few boxes far
// away do not show.
float typicalSpread(const std::vector<Centre*>& parts) {
  std::vector<float> spreads;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i)
    if (parts[i] < parts[i + 1]) spreads.push_back(spreadOf(parts[i], parts[i + 1]).mean);
  if (spreads.empty()) return 0;
  const auto quartile = spreads.begin() + static_cast<std::ptrdiff_t>(spreads.size() / 4);
  std::nth_element(spreads.begin(), quartile, spreads.end());
  return *quartile;
}

}  // namespace

// About how far apart the centres of a cell of sixteen boxes lie. A sample is halved until sixteen
// are left. If there are more boxes than in it, spreads are taken to go on as in the last halvings.
template <class Real>
double BoxClasses<Real>::cellLength(const BoxSet& boxes) const {
  // Round numbers. With a quarter of the most, bars in clusters of 500 or 1,000 boxes, of 20,000,
  // were no class, and frames took 1.06 to 1.12 of the instructions.
  constexpr std::size_t least_sampled = 64, most_sampled = 1024, sampled_share = 32;
  constexpr int compared_halvings = 2;
  std::size_t sampled = least_sampled;
  while (sampled < most_sampled && sampled * sampled_share < boxes.size) sampled *= 2;
  std::vector<Centre> sample;
  Real origin[3] = {};
  forSample<Real>(boxes, sampled, [&](Slot slot) {
    const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
    if (numberOf(box) == unbounded) return;
    Centre centre = {{}, slot};
    for (int axis = 0; axis < 3; ++axis) {
      if (sample.empty()) origin[axis] = centreOf(box, axis);
      const Real at = centreOf(box, axis) - origin[axis];
      centre.at[axis] = at == at ? static_cast<float>(at) : 0;
    }
    sample.push_back(centre);
  });
  int left = 0;  // halvings
  while (std::size_t{group_size} << (left + 1) <= sample.size()) ++left;
  std::vector<Centre*> parts = {sample.data(), sample.data() + sample.size()};
  for (double before = 0;; --left) {
    if (left == compared_halvings) before = typicalSpread(parts);
    if (left == 0) {
      const double last = typicalSpread(parts);
      if (boxes.size <= sampled || before == 0) return last;
      const double further = std::log2(static_cast<double>(boxes.size) / sampled);
      return last * std::pow(last / before, further / compared_halvings);
    }
    std::vector<Centre*> halves;
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
      const std::uint32_t axis = spreadOf(parts[i], parts[i + 1]).widest;
      halves.push_back(parts[i]);
      halves.push_back(sortByHalves(parts[i], parts[i + 1], axis));
    }
    halves.push_back(parts.back());
    parts.swap(halves);
  }
}

template <class Real>
void BoxClasses<Real>::chooseLengths(const BoxSet& boxes) {
  constexpr Real any = std::numeric_limits<Real>::max();
  std::fill(most_short_, most_short_ + 3, any);
  if (!mechanisms::box_classes) return;
  // Sums of extents and numbers of boxes on each axis, of those that are not longer than
  // most_short_, and of longer ones. No extent is less than nothing.
  double extents[3][2], counts[3][2];
  const auto sum = [&] {
    for (int axis = 0; axis < 3; ++axis) extents[axis][0] = extents[axis][1] = 0;
    for (int axis = 0; axis < 3; ++axis) counts[axis][0] = counts[axis][1] = 0;
    forSample<Real>(boxes, sampledBoxes(boxes.size), [&](Slot slot) {
      const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
      for (int axis = 0; axis < 3; ++axis) {
        const Real extent = box.upper[axis] - box.lower[axis];
        if (!(extent < any)) continue;  // unbounded
        const bool is_long = extent > most_short_[axis];
        extents[axis][is_long] += std::max(extent, Real(0));
        ++counts[axis][is_long];
      }
    });
  };
  sum();
  for (int axis = 0; axis < 3; ++axis)
    most_short_[axis] = static_cast<Real>(extents[axis][0] / std::max(counts[axis][0], 1.0));
  sum();
  std::optional<double> least_long;
  for (int axis = 0; axis < 3; ++axis) {
    if (extents[axis][1] * counts[axis][0] >= far_longer * extents[axis][0] * counts[axis][1] &&
        counts[axis][1] > 0) {
      if (!least_long) least_long = cellLength(boxes);
      if (extents[axis][1] >= *least_long * counts[axis][1]) continue;
    }
    most_short_[axis] = any;
  }
}

template <class Real>
void BoxClasses<Real>::choose(const BoxSet& boxes) {
  chooseLengths(boxes);
  std::array<ClassSummary<Real>, shapes> summaries = {};
  forSample<Real>(boxes, sampledBoxes(boxes.size), [&](Slot slot) {
    const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
    const int number = numberOf(box);
    ClassSummary<Real>& summary = summaries[number];
    summary.number = number;
    for (int axis = 0; axis < 3; ++axis) {
      const Real centre = centreOf(box, axis);
      if (summary.count == 0 || centre < summary.low[axis]) summary.low[axis] = centre;
      summary.extent[axis] += box.upper[axis] - box.lower[axis];
    }
    ++summary.count;
  });
  classes_.clear();
  for (int number = 0; number < unbounded; ++number)
    if (summaries[number].count) classes_.push_back(summaries[number]);
  const auto sizeOf = [](const ClassSummary<Real>& one) {
    return (one.extent[0] + one.extent[1] + one.extent[2]) / static_cast<double>(one.count);
  };
  std::stable_sort(classes_.begin(), classes_.end(),
                   [&](const auto& a, const auto& b) { return sizeOf(a) < sizeOf(b); });
  index_of_.fill(static_cast<std::uint8_t>(classes_.size()));
  for (std::size_t index = 0; index < classes_.size(); ++index)
    index_of_[classes_[index].number] = static_cast<std::uint8_t>(index);
  classes_.push_back({unbounded});
}

template class BoxClasses<float>;
template class BoxClasses<double>;

template <class Real>
Centre CellOrder<Real>::centreIn(const Regions& regions, const BasicBox<Real>& box,
                                 Slot slot) const {
  Centre centre;
  for (int axis = 0; axis < 3; ++axis) {
    const Real at = (centreOf(box, axis) - regions.origin[axis]) * regions.scale[axis];
    centre.at[axis] = at == at ? static_cast<float>(at) : 0;
  }
  centre.slot = slot;
  return centre;
}

// Makes a split of a class's sample, whose centres it sorts by their halves. Returns the middle.
template <class Real>
Centre* CellOrder<Real>::splitSample(const SamplePart& part) {
  const Regions& regions = regions_[part.box_class];
  const bool leads_to_regions = 2 * part.split >= regions.count;
  const std::uint32_t below = leads_to_regions ? regions.first + 2 * part.split - regions.count
                                               : regions.root + 2 * part.split - 1;
  Split& split = splits_[regions.root + part.split - 1] = {0, below << axis_bits};
  if (part.begin == part.end) return part.begin;
  const std::uint32_t axis = spreadOf(part.begin, part.end).widest;
  Centre* const middle = sortByHalves(part.begin, part.end, axis);
  split = {middle->at[axis], below << axis_bits | axis};
  return middle;
}

// Makes all splits, from a sample of each class: the upper ones here, those below on all threads.
template <class Real>
void CellOrder<Real>::splitSamples(std::vector<std::vector<Centre>>& samples, int threads) {
  std::vector<SamplePart> parts;
  std::size_t next = 0, sampled = 0;
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (regions_[i].count == 1) continue;
    regions_[i].root = static_cast<std::uint32_t>(splits_.size());
    splits_.resize(splits_.size() + regions_[i].count - 1);
    parts.push_back({i, 1, samples[i].data(), samples[i].data() + samples[i].size()});
    sampled += samples[i].size();
  }
  const auto halve = [this](const SamplePart& part, std::vector<SamplePart>& to) {
    Centre* const middle = splitSample(part);
    if (2 * part.split >= regions_[part.box_class].count) return;
    to.push_back({part.box_class, 2 * part.split, part.begin, middle});
    to.push_back({part.box_class, 2 * part.split + 1, middle, part.end});
  };
  const int team = teamFor(sampled, grains::slots, threads);
  const std::size_t wanted = team > 1 ? 2 * static_cast<std::size_t>(team) : 1;
  while (next < parts.size() && parts.size() - next < wanted) {
    const SamplePart part = parts[next++];
    halve(part, parts);
  }
  runChunks(splitting, team, parts.size() - next, 1, [&](const Range& range, int) {
    std::vector<SamplePart> own = {parts[next + range.begin]};
    while (!own.empty()) {
      const SamplePart part = own.back();
      own.pop_back();
      halve(part, own);
    }
  });
}

// Gives each class as many regions as are worth a task. Few boxes are one, without a sample.
template <class Real>
void CellOrder<Real>::layRegions(const BoxSet& boxes, int threads) {
  constexpr std::size_t sampled_in_region = 4;
  const std::size_t classes = box_classes_.count();
  std::size_t count = 0;
  for (std::size_t i = 0; i < classes; ++i) count += box_classes_.summary(i).count;
  const std::size_t boxes_a_sample =
      std::max<std::size_t>(boxes.size / std::max<std::size_t>(count, 1), 1);
  const std::size_t most =
      std::max(chunkOf(boxes.size, region_boxes, threads), boxes.size / most_regions);
  regions_.clear();
  region_count_ = most_regions_of_class_ = 0;
  for (std::size_t i = 0; i < classes; ++i) {
    const ClassSummary<Real>& summary = box_classes_.summary(i);
    Regions regions = {region_count_, region_count_, 1, {}, {}};
    while (regions.count * most < summary.count * boxes_a_sample) regions.count *= 2;
    most_regions_of_class_ = std::max(most_regions_of_class_, regions.count);
    double greatest = 0;
    for (const double extent : summary.extent)
      if (extent <= std::numeric_limits<double>::max()) greatest = std::max(greatest, extent);
    for (int axis = 0; axis < 3; ++axis) {
      regions.origin[axis] = summary.low[axis];
      regions.scale[axis] =
          static_cast<double>(summary.count) / extentToMeasureBy(summary.extent[axis], greatest);
    }
    region_count_ += regions.count;
    regions_.push_back(regions);
  }
  regions_.push_back({region_count_, region_count_, 0, {}, {}});
  splits_.clear();
  for (std::uint32_t region = 0; region <= region_count_; ++region)
    splits_.push_back({std::numeric_limits<float>::quiet_NaN(), region << axis_bits});
  if (region_count_ == classes) return;
  std::vector<std::vector<Centre>> samples(classes);
  forSample<Real>(boxes, sampled_in_region * region_count_, [&](Slot slot) {
    const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
    const std::size_t of = box_classes_.of(box);
    if (regions_[of].count > 1) samples[of].push_back(centreIn(regions_[of], box, slot));
  });
  splitSamples(samples, threads);
}

// Puts the centres of each region in a row. Within a region they keep the order of their slots.
template <class Real>
void CellOrder<Real>::dealIntoRegions(const BoxSet& boxes, int threads,
                                      Buffer<std::uint64_t>& workspace) {
  constexpr std::size_t side_by_side = 64;  // fixed: slots whose regions are found together
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  const std::size_t places = region_count_ + 1;  // of a thread: also for NaN
  positions_.resizeDiscarding(places * threads);
  order_.resizeDiscarding(boxes.size);
  static_assert(sizeof(Centre) == 2 * sizeof(std::uint64_t), "centres in words");
  workspace.resizeDiscarding(4 * boxes.size);
  centres_ = reinterpret_cast<Centre*>(workspace.data());
  Centre* const of_slot = centres_ + boxes.size;
  runTeam(assigning, threads, [&](int thread, int team) {
    const Range range = ownPart(boxes.size, thread, team);
    std::uint32_t* const counts = positions_.data() + places * thread;
    std::fill_n(counts, places, 0);
    for (std::size_t begin = range.begin, end; begin < range.end; begin = end) {
      end = std::min(range.end, begin + side_by_side);
      for (std::size_t slot = begin; slot < end; ++slot) {
        const Regions& regions =
            isActive(box[slot]) ? regions_[box_classes_.of(box[slot])] : regions_.back();
        of_slot[slot] = centreIn(regions, box[slot], static_cast<Slot>(slot));
        order_[slot] = regions.root;
      }
      // All go down side by side, as each step has to wait for the one before.
      for (std::uint32_t level = 1; level < most_regions_of_class_; level *= 2)
        for (std::size_t slot = begin; slot < end; ++slot) {
          const Split split = splits_[order_[slot]];
          order_[slot] = (split.below_axis >> axis_bits) +
                         (of_slot[slot].at[split.below_axis & axis_mask] >= split.at);
        }
      for (std::size_t slot = begin; slot < end; ++slot) ++counts[order_[slot]];
    }
  });
  ends_.resize(region_count_);
  std::uint32_t position = 0;
  for (std::uint32_t region = 0; region < region_count_; ++region) {
    for (int thread = 0; thread < threads; ++thread)
      position += std::exchange(positions_[places * thread + region], position);
    ends_[region] = position;
  }
  runTeam(dealing, threads, [&](int thread, int team) {
    const Range range = ownPart(boxes.size, thread, team);
    std::uint32_t* const next = positions_.data() + places * thread;
    for (std::size_t slot = range.begin; slot < range.end; ++slot)
      if (order_[slot] < region_count_) centres_[next[order_[slot]]++] = of_slot[slot];
  });
}

template <class Real>
void CellOrder<Real>::halveRegions(int threads) {
  const auto beginOf = [&](std::size_t region) { return region ? ends_[region - 1] : 0; };
  first_cells_.assign(region_count_ + 1, 0);
  for (std::uint32_t region = 0; region < region_count_; ++region)
    first_cells_[region + 1] = first_cells_[region] + groupsFor(ends_[region] - beginOf(region));
  starts_.resizeDiscarding(first_cells_[region_count_] + 1);
  if (rooms_.size() < static_cast<std::size_t>(threads)) rooms_.resize(threads);
  runChunks(halving, threads, region_count_, 1, [&](const Range& range, int thread) {
    const std::size_t region = range.begin, count = ends_[region] - beginOf(region);
    rooms_[thread].resizeDiscarding(roomToCut(count));
    kernelSet().cutIntoCells(centres_ + beginOf(region), count, rooms_[thread].data(),
                             beginOf(region), order_.data(), starts_.data() + first_cells_[region]);
  });
  starts_[first_cells_[region_count_]] = region_count_ ? ends_.back() : 0;
}

template <class Real>
void CellOrder<Real>::build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace) {
  box_classes_.choose(boxes);
  layRegions(boxes, threads);
  dealIntoRegions(boxes, threads, workspace);
  halveRegions(threads);
  class_ends_.clear();
  for (std::size_t i = 0; i < box_classes_.count(); ++i)
    class_ends_.push_back(first_cells_[regions_[i].first + regions_[i].count]);
}

template class CellOrder<float>;
template class CellOrder<double>;

}  // namespace ode_parallel_sap
