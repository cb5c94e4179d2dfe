// The geoms that a player makes.
#pragma once

#include <ode/ode.h>

#include "trace_reader.h"

namespace trace {

// What a geom is made as, besides the classes of ODE whose shape a trace holds.
enum Kind { by_bounds = -1, a_space = -2 };

bool hasSize(const Geom& record);
// In no space. `kind` is a Kind or a class of ODE that hasSize().
dGeomID makeShape(int kind, const Geom& record);
// Gives it the sizes of another record.
void resizeShape(dGeomID geom, int kind, const Geom& record);
// Of one that is made by its bounds; it is to be marked as moved.
void setBounds(dGeomID geom, const Bounds& bounds);

bool isPlaceable(int kind);
// Whether ODE gives it the bounding box that was written, to the last bit.
bool hasWrittenBounds(dGeomID geom, const Bounds& bounds);

// Place and rotation as they were written: the setters of bodies would round them once more.
void setBodyPose(dBodyID body, const Pose& pose);
void setGeomPose(dGeomID geom, const Pose& pose);
void setOffset(dGeomID geom, const Pose& pose);

}  // namespace trace
