/* Finding the functions that the preload library stands in front of. */
#pragma once

/* The symbol `name` as the code at `caller` would get it without the preload library: from the
 * objects that every object sees, or else from those that the caller's own object was linked with,
 * which is where a plug-in's ODE is. Null if there is none. `own` is never the answer. */
void* realSymbol(const char* name, const void* caller, const void* own);

/* The file that an address belongs to. */
const char* fileOf(const void* address);
