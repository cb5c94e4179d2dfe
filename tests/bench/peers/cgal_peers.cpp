// CGAL: Intersecting Sequences of dD Iso-oriented Boxes (Zomorodian and Edelsbrunner's hybrid of
// streaming segment trees). It keeps nothing between calls but reorders the boxes it is given.
#include <CGAL/box_intersection_d.h>
#include <CGAL/version.h>

#include "../peer.h"

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

template <class Callback>
void intersect(std::vector<NumberedBox>& boxes, const Callback& callback) {
  using Traits = CGAL::Box_intersection_d::Box_traits_d<NumberedBox>;
  CGAL::box_self_intersection_d<CGAL::Sequential_tag>(boxes.begin(), boxes.end(), callback,
                                                      Traits(), std::ptrdiff_t(10),
                                                      CGAL::Box_intersection_d::CLOSED);
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
    intersect(boxes_, [&](const NumberedBox&, const NumberedBox&) { ++pairs; });
    return pairs;
  }

  void visit(const PairVisitor& visitor) override {
    intersect(boxes_, [&](const NumberedBox& a, const NumberedBox& b) { visitor(a.id(), b.id()); });
  }

 private:
  std::vector<NumberedBox> boxes_;
};

const AddPeers added([](std::vector<PeerKind>& kinds) {
  PeerKind kind;
  kind.name = "cgal";
  kind.library = "CGAL " CGAL_VERSION_STR;
  kind.create = [](int) { return std::make_unique<CgalPeer>(); };
  kinds.push_back(kind);
});

}  // namespace
}  // namespace bench
