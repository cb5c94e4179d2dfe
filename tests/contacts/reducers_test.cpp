// dParallelSAPKeepDeepest and dParallelSAPKeepSpread keep what they say, whatever the contacts are.
#include <cstring>

#include "support/mesh.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

using Manifold = std::vector<dContactGeom>;
using Reducer = int (*)(dContactGeom*, int, int);
const Reducer kReducers[] = {dParallelSAPKeepDeepest, dParallelSAPKeepSpread};

// Its place travels in side1.
dContactGeom contact(double x, double y, double z, double depth, int place) {
  dContactGeom made = {};
  made.pos[0] = real(x);
  made.pos[1] = real(y);
  made.pos[2] = real(z);
  made.normal[2] = 1;
  made.depth = real(depth);
  made.side1 = place;
  return made;
}

// Contacts of any kind: with equal depths and places, on lines, with no numbers among them.
Manifold anyContacts(Random& random) {
  const std::size_t kind = random.below(6), count = random.below(kind == 5 ? 200 : 14);
  Manifold contacts;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = kind == 1 ? std::floor(random.between(0, 3)) : random.between(-1, 1);
    const double y = kind == 2   ? 2 * x
                     : kind == 1 ? std::floor(random.between(0, 3))
                                 : random.between(-1, 1);
    const double depth = random.chance(0.3) ? 0.5 : random.between(0, 1);
    contacts.push_back(contact(x, y, random.between(-0.1, 0.1), depth, static_cast<int>(i)));
    if (kind == 3)
      for (int axis = 0; axis < 3; ++axis)
        contacts.back().normal[axis] = real(random.between(-1, 1));
    if (kind == 4) {
      const dReal odd[] = {kNaN,       kInfinity,
                           -kInfinity, std::numeric_limits<dReal>::max(),
                           0,          std::numeric_limits<dReal>::denorm_min()};
      dReal* const all[] = {&contacts.back().pos[random.below(3)], &contacts.back().depth,
                            &contacts.back().normal[random.below(3)]};
      *all[random.below(3)] = odd[random.below(6)];
    }
  }
  return contacts;
}

bool isUsable(const dContactGeom& a) {
  const dReal* const n = a.normal;
  dReal sum = 0;  // NaN where one is not finite
  for (const dReal x : {n[0], n[1], n[2], a.pos[0], a.pos[1], a.pos[2], a.depth}) sum += 0 * x;
  return (n[0] != 0 || n[1] != 0 || n[2] != 0) && sum == 0;
}

std::vector<int> placesOf(const Manifold& contacts, std::size_t count) {
  std::vector<int> places;
  for (std::size_t i = 0; i < count; ++i) places.push_back(contacts[i].side1);
  return places;
}

// Of the convex hull of the first `count` contacts, seen along z.
double areaOf(const Manifold& contacts, std::size_t count) {
  std::vector<std::pair<double, double>> points, hull;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(contacts[i].pos[0], contacts[i].pos[1]);
  std::sort(points.begin(), points.end());
  const auto turn = [](const auto& a, const auto& b, const auto& c) {
    return (b.first - a.first) * (c.second - a.second) -
           (b.second - a.second) * (c.first - a.first);
  };
  for (int side = 0; side < 2; ++side) {  // Andrew's monotone chain
    const std::size_t least = hull.size();
    for (const auto& point : points) {
      while (hull.size() >= least + 2 && turn(hull[hull.size() - 2], hull.back(), point) <= 0)
        hull.pop_back();
      hull.push_back(point);
    }
    if (!hull.empty()) hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  double area = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const auto &a = hull[i], &b = hull[(i + 1) % hull.size()];
    area += (a.first * b.second - b.first * a.second) / 2;
  }
  return area;
}

// Of hulls and distances of whole numbers, which no rounding blurs: what the header says.
std::vector<int> spreadOf(Manifold contacts, std::size_t most) {
  const auto choose = [&](std::size_t place, auto worth) {
    std::size_t best = place;
    for (std::size_t i = place + 1; i < contacts.size(); ++i)
      if (worth(contacts[i]) > worth(contacts[best])) best = i;
    const auto at = contacts.begin();
    std::rotate(at + long(place), at + long(best), at + long(best) + 1);
  };
  choose(0, [](const dContactGeom& a) { return a.depth; });
  choose(1, [&](const dContactGeom& a) {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += std::pow(a.pos[axis] - contacts[0].pos[axis], 2);
    return sum;
  });
  for (std::size_t place = 2; place < most; ++place) {
    const auto area = [&](const dContactGeom& a) {
      Manifold chosen(contacts.begin(), contacts.begin() + long(place));
      chosen.push_back(a);
      return areaOf(chosen, chosen.size());
    };
    const double before = areaOf(contacts, place);
    choose(place, [&](const dContactGeom& a) {
      return std::make_pair(area(a), area(a) > before ? dReal(0) : a.depth);
    });
  }
  return placesOf(contacts, most);
}

bool isDeeper(const dContactGeom& a, const dContactGeom& b) {
  return a.depth > b.depth;
}

}  // namespace

TEST_CASE("Reducers keep as many contacts as they are asked to, and lose none", "[reducers]") {
  Random random(seedOr(61));
  for (int run = 0; run < scaled(20000); ++run) {
    const Manifold before = anyContacts(random);
    const int count = static_cast<int>(before.size()), most = static_cast<int>(random.below(17));
    for (const Reducer reduce : kReducers) {
      Manifold contacts = before, again = before;
      const int kept = reduce(contacts.data(), count, most);
      const auto usable = std::count_if(before.begin(), before.end(), isUsable);
      REQUIRE(kept == std::min(static_cast<int>(usable), most));
      REQUIRE(std::all_of(contacts.begin(), contacts.begin() + kept, isUsable));
      REQUIRE(reduce(again.data(), count, most) == kept);
      REQUIRE(placesOf(contacts, before.size()) == placesOf(again, before.size()));
      // What is not kept stays in its order.
      std::vector<int> places = placesOf(contacts, before.size());
      REQUIRE(std::is_sorted(places.begin() + kept, places.end()));
      std::sort(places.begin(), places.end());
      REQUIRE(places == placesOf(before, before.size()));
      for (const dContactGeom& moved : contacts)
        REQUIRE(std::memcmp(&moved, &before[static_cast<std::size_t>(moved.side1)], sizeof moved) ==
                0);
    }
  }
}

TEST_CASE("The deepest contacts are kept, the deepest first, the earlier one of equals",
          "[reducers]") {
  Random random(seedOr(62));
  for (int run = 0; run < scaled(20000); ++run) {
    const Manifold before = anyContacts(random);
    Manifold contacts = before, expected = before;
    std::stable_sort(expected.begin(),
                     std::stable_partition(expected.begin(), expected.end(), isUsable), isDeeper);
    const int most = static_cast<int>(random.below(17));
    const auto kept = static_cast<std::size_t>(
        dParallelSAPKeepDeepest(contacts.data(), static_cast<int>(before.size()), most));
    REQUIRE(placesOf(contacts, kept) == placesOf(expected, kept));
    // The other reducer begins with the same one.
    Manifold spread = before;
    if (dParallelSAPKeepSpread(spread.data(), static_cast<int>(before.size()), most))
      REQUIRE(spread[0].side1 == contacts[0].side1);
  }
}

TEST_CASE("Each contact that is kept adds as much area as any could, the earlier one of equals",
          "[reducers]") {
  Random random(seedOr(64));
  for (int run = 0; run < scaled(20000); ++run) {
    Manifold contacts;
    const std::size_t count = 4 + random.below(9);
    const unsigned width = 1 + static_cast<unsigned>(random.below(4));
    const auto any = [&] { return static_cast<double>(random.below(width)); };
    for (std::size_t i = 0; i < count; ++i)
      contacts.push_back(contact(any(), any(), 3 * any(), any(), static_cast<int>(i)));
    const std::size_t most = 2 + random.below(count - 1);
    const std::vector<int> expected = spreadOf(contacts, most);
    const int kept = static_cast<int>(most);
    REQUIRE(dParallelSAPKeepSpread(contacts.data(), static_cast<int>(count), kept) == kept);
    REQUIRE(placesOf(contacts, most) == expected);
  }
}

TEST_CASE("Contacts on a ring are kept in any number", "[reducers]") {
  constexpr int count = 300;
  Manifold ring;
  for (int i = 0; i < count; ++i)
    ring.push_back(contact(std::cos(0.02 * i), std::sin(0.02 * i), 0, 1, i));
  CHECK(dParallelSAPKeepSpread(ring.data(), count, count) == count);
  std::vector<int> places = placesOf(ring, count);
  std::sort(places.begin(), places.end());
  for (int i = 0; i < count; ++i) REQUIRE(places[static_cast<std::size_t>(i)] == i);
}

TEST_CASE("A sphere in a mesh's plane gets a NaN of dCollide, which is reported and told once",
          "[reducers]") {
  const Mesh square({-5, -5, 0, 5, -5, 0, 5, 5, 0, -5, 5, 0}, {0, 1, 2, 0, 2, 3});
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  square.create(space);
  const dGeomID sphere = dCreateSphere(space, real(0.5));
  struct Seen {
    int pairs = 0, not_finite = 0;
  };
  const auto look = [](void* seen, dGeomID, dGeomID, const dContactGeom* contacts, int count) {
    ++static_cast<Seen*>(seen)->pairs;
    for (int i = 0; i < count; ++i) static_cast<Seen*>(seen)->not_finite += !isUsable(contacts[i]);
  };
  const auto most = [](void*, dGeomID, dGeomID) { return 8; };
  const auto spread = [](void*, dGeomID, dGeomID, dContactGeom* contacts, int count) {
    return dParallelSAPKeepSpread(contacts, count, 8);
  };
  Random random(seedOr(67));
  for (const bool reduces : {false, true}) {
    const Messages messages;
    const dParallelSAPContactCallbacks callbacks = {look, most, reduces ? +spread : nullptr,
                                                    nullptr};
    Seen seen;
    for (int run = 0; run < 300; ++run) {
      dGeomSetPosition(sphere, real(random.between(-1, 1)), real(random.between(-1, 1)), 0);
      dParallelSAPSpaceCollideContacts(space, &seen, 8, &callbacks);
    }
    INFO("reduces " << reduces);
    CHECK((seen.not_finite > 0) == !reduces);
    CHECK(messages.all().size() == (reduces ? 0 : 1));
  }
  dSpaceDestroy(space);
}

TEST_CASE("Contacts that ODE's colliders find beside their geoms are kept last", "[reducers]") {
  const Mesh square({-5, -5, 0, 5, -5, 0, 5, 5, 0, -5, 5, 0}, {0, 1, 2, 0, 2, 3});
  const dGeomID floor = square.create(nullptr);
  const dGeomID box = dCreateBox(nullptr, 1, 1, 1);
  Random random(seedOr(65));
  int beside = 0;
  for (int run = 0; run < scaled(20000); ++run) {
    dMatrix3 turn;
    const auto angle = [&](double most) { return real(random.between(-most, most)); };
    dRFromEulerAngles(turn, angle(0.005), angle(0.005), angle(3));
    dGeomSetRotation(box, turn);
    dGeomSetPosition(box, angle(0.5), angle(0.5), dReal(0.5));
    dReal bounds[6];
    dGeomGetAABB(box, bounds);
    const dReal* const at = dGeomGetPosition(box);
    dGeomSetPosition(box, at[0], at[1], at[2] - bounds[4] - dReal(0.002));
    dGeomGetAABB(box, bounds);
    dContactGeom found[64];
    const int count = dCollide(box, floor, 64, found, sizeof(dContactGeom));
    const auto areBeside = [&](const dContactGeom* contacts, int many) {
      return std::count_if(contacts, contacts + many, [&](const dContactGeom& a) {
        double off = 0;
        for (int axis = 0; axis < 3; ++axis)
          off = std::max<double>(
              {off, bounds[2 * axis] - a.pos[axis], a.pos[axis] - bounds[2 * axis + 1]});
        return off > a.depth + 0.001;
      });
    };
    const auto bogus = static_cast<int>(areBeside(found, count));
    beside += bogus > 0;
    for (const Reducer reduce : kReducers) {
      Manifold contacts(found, found + count);
      const int kept = reduce(contacts.data(), count, 4), good = std::min(4, count - bogus);
      REQUIRE(kept == std::min(count, 4));
      REQUIRE(areBeside(contacts.data(), good) == 0);
    }
  }
  CHECK(beside > scaled(20000) / 200);
  dGeomDestroy(box);
  dGeomDestroy(floor);
}
