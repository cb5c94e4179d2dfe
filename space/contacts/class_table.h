// Where the program's ODE keeps the user's classes.
#pragma once

namespace ode_parallel_sap {

// Has `user_classes` (space/geom/user_classes.h) tell where, for the rest of the process. An image
// of ODE is loaded for it, once: the table is where the image has the classes that it is given
// here, and the program's own classes are neither changed nor added to. Where there can be no image
// the AABBTests of all classes go on being called; dMessage says why, once.
void findUserClasses();

}  // namespace ode_parallel_sap
