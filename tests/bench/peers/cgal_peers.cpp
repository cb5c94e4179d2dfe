// CGAL: Intersecting Sequences of dD Iso-oriented Boxes (Zomorodian and Edelsbrunner's hybrid of
// streaming segment trees). It keeps nothing between calls but reorders the boxes it is given.
#include <CGAL/box_intersection_d.h>
#include <CGAL/version.h>

#include "../peer.h"

#ifdef BENCH_TBB
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#endif

namespace bench {
namespace {

// A model of CGAL's concept BoxIntersectionBox_d. The default's identity is the address, which the
// sorting of values would change.
class NumberedBox {
 public:
  using NT = double;
  using ID = std::size_t;
  NumberedBox() = default;
  NumberedBox(const CentredBox& box, std::size_t number) : number_(static_cast<unsigned>(number)) {
    for (int axis = 0; axis < 3; ++axis) {
      low_[axis] = box.low(axis);
      high_[axis] = box.high(axis);
    }
  }
  static int dimension() { return 3; }
  ID id() const { return number_; }
  NT min_coord(int axis) const { return low_[axis]; }
  NT max_coord(int axis) const { return high_[axis]; }

 private:
  NT low_[3], high_[3];
  unsigned number_;
};

template <class Tag, class Callback>
void intersect(std::vector<NumberedBox>& boxes, const Callback& callback) {
  using Traits = CGAL::Box_intersection_d::Box_traits_d<NumberedBox>;
  CGAL::box_self_intersection_d<Tag>(boxes.begin(), boxes.end(), callback, Traits(),
                                     std::ptrdiff_t(10), CGAL::Box_intersection_d::CLOSED);
}

class CgalPeer : public Peer {
 public:
  void create(const Boxes& boxes) override { move(boxes); }
  void enter() override {}

  void move(const Boxes& boxes) override {
    boxes_.resize(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) boxes_[i] = NumberedBox(boxes[i], i);
  }

  std::size_t find() override {
    std::size_t pairs = 0;
    intersect<CGAL::Sequential_tag>(boxes_,
                                    [&](const NumberedBox&, const NumberedBox&) { ++pairs; });
    return pairs;
  }

  void visit(const PairVisitor& visitor) override {
    intersect<CGAL::Sequential_tag>(
        boxes_, [&](const NumberedBox& a, const NumberedBox& b) { visitor(a.id(), b.id()); });
  }

 protected:
  std::vector<NumberedBox> boxes_;
};

#ifdef BENCH_TBB
// A counter for each thread, on a cache line of its own: an atomic one would cost more than the
// search.
struct alignas(64) Counter {
  std::size_t value = 0;
};

class CgalParallelPeer : public CgalPeer {
 public:
  explicit CgalParallelPeer(int threads)
      : limit_(oneapi::tbb::global_control::max_allowed_parallelism,
               static_cast<std::size_t>(threads)),
        arena_(threads),
        counters_(static_cast<std::size_t>(threads)) {}

  std::size_t find() override {
    for (Counter& counter : counters_) counter.value = 0;
    arena_.execute([&] {
      intersect<CGAL::Parallel_tag>(boxes_, [&](const NumberedBox&, const NumberedBox&) {
        ++counters_[threadNumber()].value;
      });
    });
    std::size_t pairs = 0;
    for (const Counter& counter : counters_) pairs += counter.value;
    return pairs;
  }

  void visit(const PairVisitor& visitor) override {
    std::vector<std::vector<std::pair<std::size_t, std::size_t>>> found(counters_.size());
    arena_.execute([&] {
      intersect<CGAL::Parallel_tag>(boxes_, [&](const NumberedBox& a, const NumberedBox& b) {
        found[threadNumber()].emplace_back(a.id(), b.id());
      });
    });
    for (const auto& part : found)
      for (const auto& [a, b] : part) visitor(a, b);
  }

 private:
  static std::size_t threadNumber() {
    return static_cast<std::size_t>(oneapi::tbb::this_task_arena::current_thread_index());
  }

  oneapi::tbb::global_control limit_;
  oneapi::tbb::task_arena arena_;
  std::vector<Counter> counters_;
};
#endif

const AddPeers added([](std::vector<PeerKind>& kinds) {
  PeerKind kind;
  kind.name = "cgal";
  kind.library = "CGAL " CGAL_VERSION_STR;
  kind.create = [](int) { return std::make_unique<CgalPeer>(); };
  kinds.push_back(kind);
#ifdef BENCH_TBB
  kind.name = "cgal-parallel";
  kind.takes_threads = true;
  kind.create = [](int threads) { return std::make_unique<CgalParallelPeer>(threads); };
  kinds.push_back(kind);
#endif
});

}  // namespace
}  // namespace bench
