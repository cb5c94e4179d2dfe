/* Makes the program's ODE one that is laid out otherwise, as far as a library that looks can see:
 * what is set as a space's sublevel is elsewhere. */
#include <ode/ode.h>

void dSpaceSetSublevel(dSpaceID space, int sublevel) {
  (void)space, (void)sublevel;
}
