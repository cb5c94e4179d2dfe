#include "box3d_world.h"

#include "aabb.h"
#include "body.h"
#include "box3d/box3d.h"
#include "broad_phase.h"
#include "contact.h"
#include "physics_world.h"
#include "scheduler.h"
#include "shape.h"
#include "solver_set.h"

#include <stdlib.h>

struct BenchBox3d {
  b3WorldId id;
  b3World* world;
  int* shapes;   // by the number of the box
  int* numbers;  // by the index of the shape
};

static b3AABB boundsOf(const BenchBox3dBounds* box) {
  return (b3AABB){{box->low[0], box->low[1], box->low[2]},
                  {box->high[0], box->high[1], box->high[2]}};
}

// The shape is a sphere, whose size tells how much its box is enlarged; where it is is never asked.
static int addBox(BenchBox3d* self, const BenchBox3dBounds* box) {
  b3BodyDef body_def = b3DefaultBodyDef();
  body_def.type = b3_dynamicBody;
  body_def.position = (b3Pos){(box->low[0] + box->high[0]) / 2, (box->low[1] + box->high[1]) / 2,
                              (box->low[2] + box->high[2]) / 2};
  const b3BodyId body = b3CreateBody(self->id, &body_def);
  float radius = 0;
  for (int axis = 0; axis < 3; ++axis)
    radius = b3MaxFloat(radius, (box->high[axis] - box->low[axis]) / 2);
  const b3Sphere sphere = {{0, 0, 0}, radius};
  const b3ShapeDef shape_def = b3DefaultShapeDef();
  return b3CreateSphereShape(body, &shape_def, &sphere).index1 - 1;
}

// As the solver enlarges what has left its enlarged box.
static void moveBox(BenchBox3d* self, int shape_index, const BenchBox3dBounds* box) {
  b3Shape* shape = self->world->shapes.data + shape_index;
  shape->aabb = boundsOf(box);
  if (b3AABB_Contains(shape->fatAABB, shape->aabb)) return;
  const b3Vec3 margin = {shape->aabbMargin, shape->aabbMargin, shape->aabbMargin};
  shape->fatAABB.lowerBound = b3Sub(shape->aabb.lowerBound, margin);
  shape->fatAABB.upperBound = b3Add(shape->aabb.upperBound, margin);
  b3BroadPhase_EnlargeProxy(&self->world->broadPhase, shape->proxyKey, shape->fatAABB);
}

static void destroyEndedContacts(b3World* world) {
  // The last takes the place of one that is destroyed.
  for (int i = world->solverSets.data[b3_awakeSet].contactIndices.count - 1; i >= 0; --i) {
    b3Contact* contact =
        world->contacts.data + world->solverSets.data[b3_awakeSet].contactIndices.data[i];
    const b3Shape* a = world->shapes.data + contact->shapeIdA;
    const b3Shape* b = world->shapes.data + contact->shapeIdB;
    if (!b3AABB_Overlaps(a->fatAABB, b->fatAABB)) b3DestroyContact(world, contact, false);
  }
}

// New pairs and, on another thread if there is one, a new tree.
static void updatePairs(b3World* world) {
  world->taskCount = 0;
  world->activeTaskCount = 0;
  if (world->scheduler) b3ResetScheduler(world->scheduler);
  b3UpdateBroadPhasePairs(world);
  destroyEndedContacts(world);
  if (world->userTreeTask) {
    world->finishTaskFcn(world->userTreeTask, world->userTaskContext);
    world->userTreeTask = NULL;
  }
  b3GrowStack(&world->stack);
}

BenchBox3d* benchBox3dCreate(const BenchBox3dBounds* boxes, int count, int threads) {
  BenchBox3d* self = malloc(sizeof *self);
  b3WorldDef def = b3DefaultWorldDef();
  def.workerCount = threads;
  def.capacity.dynamicBodyCount = def.capacity.dynamicShapeCount = count;
  self->id = b3CreateWorld(&def);
  self->world = b3GetWorldFromId(self->id);
  self->shapes = malloc(sizeof(int) * (size_t)(count + 1));
  self->numbers = malloc(sizeof(int) * (size_t)(count + 1));
  for (int i = 0; i < count; ++i) {
    const int shape = addBox(self, boxes + i);
    self->shapes[i] = shape;
    self->numbers[shape] = i;
    moveBox(self, shape, boxes + i);
  }
  updatePairs(self->world);
  return self;
}

void benchBox3dDestroy(BenchBox3d* self) {
  b3DestroyWorld(self->id);
  free(self->shapes);
  free(self->numbers);
  free(self);
}

int benchBox3dUpdate(BenchBox3d* self, const BenchBox3dBounds* boxes, const int* moved,
                     int moved_count) {
  for (int i = 0; i < moved_count; ++i) moveBox(self, self->shapes[moved[i]], boxes + moved[i]);
  updatePairs(self->world);
  return self->world->solverSets.data[b3_awakeSet].contactIndices.count;
}

void benchBox3dVisit(const BenchBox3d* self, void (*visitor)(void*, int, int), void* data) {
  const b3World* world = self->world;
  for (int i = 0; i < world->solverSets.data[b3_awakeSet].contactIndices.count; ++i) {
    const b3Contact* contact =
        world->contacts.data + world->solverSets.data[b3_awakeSet].contactIndices.data[i];
    visitor(data, self->numbers[contact->shapeIdA], self->numbers[contact->shapeIdB]);
  }
}
