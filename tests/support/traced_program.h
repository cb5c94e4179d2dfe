// A program that does to a parallel SAP space and its geoms what programs do, for traces of it.
#pragma once

#include <ode/ode.h>

#include <cstdint>
#include <vector>

#include "random.h"

namespace sap_test {

class TracedProgram {
 public:
  // Shapes of all kinds, with and without bodies, on one body, with offsets, in nested spaces.
  TracedProgram(std::uint64_t seed, int geoms);
  ~TracedProgram();
  TracedProgram(const TracedProgram&) = delete;
  TracedProgram& operator=(const TracedProgram&) = delete;

  dSpaceID space() const { return space_; }
  // Moves many, and adds, removes, disables, resizes, re-categorises, puts to sleep, ... some.
  void edit();

 private:
  struct Member {
    dGeomID geom;
    dSpaceID in;
    bool placeable;
  };

  dGeomID makeGeom();
  void add(dSpaceID space);
  void addSpace();
  void move(Member& member);
  void resize(dGeomID geom);
  void editMember(std::size_t place);
  void removeMember(std::size_t place);
  void changeBody(Member& member);
  void changeSettings();
  dSpaceID anySpace();
  dReal coordinate();

  Random random_;
  dWorldID world_;
  dSpaceID space_;
  std::vector<dSpaceID> inner_;
  std::vector<Member> members_;
  std::vector<dBodyID> bodies_;
  double side_;
};

}  // namespace sap_test
