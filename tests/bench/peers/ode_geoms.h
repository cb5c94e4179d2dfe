// The part that all of ODE's spaces, ours among them, have in common: boxes as geoms.
#pragma once

#include <ode/ode.h>

#include <vector>

#include "../peer.h"

namespace bench {

class OdeSpacePeer : public Peer {
 public:
  // With bodies, those of boxes that did not move in a frame are disabled.
  explicit OdeSpacePeer(bool with_bodies = false);
  ~OdeSpacePeer() override;

  void create(const Boxes& boxes) override;
  void enter() override;
  void move(const Boxes& boxes) override;
  std::size_t find() override;
  void visit(const PairVisitor& visitor) override;

 protected:
  // Called once the geoms exist. The space neither owns nor destroys them.
  virtual dSpaceID createSpace(const Extent& extent, std::size_t count) = 0;
  // The geom's body was enabled by a call.
  virtual void woke(dGeomID) {}

  dSpaceID space_ = nullptr;

 private:
  const dWorldID world_;
  std::vector<dGeomID> geoms_;
  Boxes shown_;
  Extent extent_;
};

// "ODE 0.16.2, double precision".
std::string odeVersion();

}  // namespace bench
