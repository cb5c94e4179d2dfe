#include "space/cells/filter_groups.h"

#include "space/data/mechanisms.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

namespace {

Region surveying("filter groups: kinds"), noting("filter groups: slots");

}  // namespace

// The number of a kind, or the number of kinds.
std::size_t FilterGroups::Survey::of(const FilterBits& bits) const {
  std::size_t kind = 0;
  while (kind < count &&
         (kinds[kind].category != bits.category || kinds[kind].collide != bits.collide))
    ++kind;
  return kind;
}

void FilterGroups::Survey::add(const FilterBits& bits, std::size_t with_them) {
  if (tooMany()) return;
  const std::size_t kind = of(bits);
  if (kind == count) {
    if (++count > most) return;
    kinds[kind] = bits;
    boxes[kind] = 0;
  }
  boxes[kind] += with_them;
}

// Whether a quarter of the pairs of any two boxes are of kinds that do not meet.
bool FilterGroups::Survey::areMuchApart() const {
  double all = 0, apart = 0;
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b) {
      const double pairs = static_cast<double>(boxes[a]) * static_cast<double>(boxes[b]);
      all += pairs;
      if (!(kinds[a].category & kinds[b].collide) && !(kinds[b].category & kinds[a].collide))
        apart += pairs;
    }
  return 4 * apart >= all;
}

template <class Real>
void FilterGroups::choose(const BoxSet& boxes, int threads) {
  count_ = 1;
  if (!mechanisms::filter_groups || !boxes.filter_bits) return;
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  surveys_.assign(static_cast<std::size_t>(threads), {});
  runTeam(surveying, threads, [&](int thread, int team) {
    const Range range = ownPart(boxes.size, thread, team);
    Survey& own = surveys_[thread];
    for (std::size_t slot = range.begin; slot < range.end && !own.tooMany(); ++slot)
      if (isActive(box[slot])) own.add(boxes.bits[slot], 1);
  });
  Survey all;
  for (const Survey& survey : surveys_) {
    if (survey.tooMany()) return;
    for (std::size_t kind = 0; kind < survey.count; ++kind)
      all.add(survey.kinds[kind], survey.boxes[kind]);
  }
  if (all.tooMany() || all.count < 2 || !all.areMuchApart()) return;
  count_ = all.count;
  group_of_slot_.resizeDiscarding(boxes.size);
  runTeam(noting, threads, [&](int thread, int team) {
    const Range range = ownPart(boxes.size, thread, team);
    for (std::size_t slot = range.begin; slot < range.end; ++slot)
      group_of_slot_[slot] = static_cast<std::uint8_t>(all.of(boxes.bits[slot]));
  });
}

template void FilterGroups::choose<float>(const BoxSet& boxes, int threads);
template void FilterGroups::choose<double>(const BoxSet& boxes, int threads);

}  // namespace ode_parallel_sap
