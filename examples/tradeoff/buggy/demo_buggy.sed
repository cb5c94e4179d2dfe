# What is changed of ODE's demo_buggy.cpp so that it can be studied (buggy.cpp includes what comes out):
#   sed -f demo_buggy.sed demo_buggy.cpp >demo_buggy_parts.h
# Nothing is drawn.
/drawstuff\.h/d
/texturepath\.h/d
/^static void start/,/^}/d
# 1. Its main builds the scene in the world and the space that it is given, and ends there.
s/^int main .*/static void build (dWorldID given_world, dSpaceID given_space)/
/^  dsFunctions fn;/,/^  fn\.path_to_textures/d
/^  dInitODE2/d
s/dWorldCreate();/given_world;/
s/dHashSpaceCreate (0);/given_space;/
/^  \/\/ run simulation/,$c\
}
# 2. Its loop only drives: collisions and steps are the harness's.
/dSpaceCollide (space/,/^}/c\
  }\
}
# 3. Its callback says which contacts there are and what surface they have.
/^static void nearCallback/c\
static bool surface (dContact &contact)
/^  int i,n;/c\
  const dGeomID o1 = contact.geom.g1, o2 = contact.geom.g2;
s/if (!(g1 ^ g2)) return;/if (!(g1 ^ g2)) return false;/
/^  const int N = 10;/,/^    for (i=0; i<n; i++) {/d
s/contact\[i\]\.surface/contact.surface/
/dJointID c = dJointCreateContact/,/^}/c\
  return true;\
}
