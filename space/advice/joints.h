// What the warnings ask of joints.
#pragma once

#include <ode/ode.h>

#include <algorithm>

namespace ode_parallel_sap {

constexpr int most_joints = 128;  // fixed: of a body; dBodyGetJoint counts from the first

// Calls use(joint, the other body) for the first joints of a body.
template <class Use>
void forJoints(dBodyID body, Use use) {
  const int joints = std::min(most_joints, dBodyGetNumJoints(body));
  for (int i = 0; i < joints; ++i) {
    const dJointID joint = dBodyGetJoint(body, i);
    const dBodyID first = dJointGetBody(joint, 0);
    use(joint, first == body ? dJointGetBody(joint, 1) : first);
  }
}

inline bool isContact(dJointID joint) {
  return dJointGetType(joint) == dJointTypeContact;
}

// Between its anchors.
inline double gapOf(dJointID joint) {
  dVector3 a = {0, 0, 0, 0}, b = {0, 0, 0, 0};
  switch (dJointGetType(joint)) {
    case dJointTypeBall:
      dJointGetBallAnchor(joint, a);
      dJointGetBallAnchor2(joint, b);
      break;
    case dJointTypeHinge:
      dJointGetHingeAnchor(joint, a);
      dJointGetHingeAnchor2(joint, b);
      break;
    case dJointTypeUniversal:
      dJointGetUniversalAnchor(joint, a);
      dJointGetUniversalAnchor2(joint, b);
      break;
    default:
      break;
  }
  dSubtractVectors3(a, a, b);
  return static_cast<double>(dCalcVectorLength3(a));
}

// Whether it has a motor, or lets nothing turn.
inline bool holds(dJointID joint) {
  switch (dJointGetType(joint)) {
    case dJointTypeHinge:
      return dJointGetHingeParam(joint, dParamFMax) > 0;
    case dJointTypeUniversal:
      return dJointGetUniversalParam(joint, dParamFMax) > 0;
    case dJointTypeAMotor:
      return dJointGetAMotorParam(joint, dParamFMax) > 0;
    default:
      return dJointGetType(joint) == dJointTypeFixed;
  }
}

}  // namespace ode_parallel_sap
