// The part of a Box3D world that finds pairs. Its broad phase cannot be called from outside, so
// this does what b3World_Step does around it: boxes that left their enlarged box are entered anew
// (the end of a solver's step), new pairs are looked for and become contacts, the tree is rebuilt
// beside that, and contacts whose enlarged boxes are apart are destroyed (the head of the narrow
// phase). Nothing is collided or solved.
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

typedef struct BenchBox3d BenchBox3d;

// Lower and upper corner.
typedef struct BenchBox3dBounds {
  float low[3], high[3];
} BenchBox3dBounds;

// Each box on a dynamic body of its own.
BenchBox3d* benchBox3dCreate(const BenchBox3dBounds* boxes, int count, int threads);
void benchBox3dDestroy(BenchBox3d* world);

// Brings the named boxes up to date and all contacts with them; returns the number of contacts.
int benchBox3dUpdate(BenchBox3d* world, const BenchBox3dBounds* boxes, const int* moved,
                     int moved_count);
// The numbers of the boxes of each contact.
void benchBox3dVisit(const BenchBox3d* world, void (*visitor)(void*, int, int), void* data);

#ifdef __cplusplus
}
#endif
