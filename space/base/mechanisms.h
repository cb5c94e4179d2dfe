// What is done beyond the plain pipeline so that frames take less time.
#pragma once

// Pairs and their order depend on none of these. tests/bench/ablation.py builds the library once
// without each and measures what that costs (tests/bench/ABLATION.md); one that gains nothing goes.
namespace ode_parallel_sap::mechanisms {

// From frame to frame.

// Pairs of what did not change stay (PairCache).
constexpr bool kept_pairs = true;
// What changed meets a kept tree (GeomTree). Else any change has all found anew.
constexpr bool incremental_trees = true;
// Pairs of boxes with room to move in are kept where all move by little or together (FatProxies).
constexpr bool fat_pairs = true;
// Cells are kept while their boxes stay together (Sweep).
constexpr bool kept_cells = true;
// The pairs of a small scene that stands still are remembered (SmallLists).
constexpr bool still_small_scenes = true;

// The choice of a method.

// Up to 120 geoms are collided in one loop (small_scenes.cpp).
constexpr bool small_scenes = true;

// The sweep.

// Boxes that are far longer than others on an axis have cells of their own (BoxClasses).
constexpr bool box_classes = true;

// Queries.

// They walk a tree (CellTrees). Else each tests geom by geom.
constexpr bool query_trees = true;
// What moved is put into that tree. Else it is built anew.
constexpr bool kept_query_tree = true;
}  // namespace ode_parallel_sap::mechanisms
