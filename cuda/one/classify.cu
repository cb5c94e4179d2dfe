#include "cuda/one/classify.h"
//
#include "cuda/one/curve.h"
#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

constexpr int choose_threads = octaves;

// fixed: extents are summed in steps of 2^-16 of the class's largest. A thread adds up at most
// most_run of them before it hands on, which fit 32 bits.
constexpr float fixed_point = 65536.0f;
constexpr std::uint32_t most_run = 4096;

// One thread a box, one block block_threads boxes, in strides; a histogram for each block in shared
// memory. bins + 1 counters: binOf is below bins, the last one counts inactive boxes. Boxes pass
// through shared memory, eight bytes a thread at a time: warps read whole lines, also the host's.
__global__ void __launch_bounds__(block_threads)
    surveyKernel(const float* from, std::size_t begin, std::size_t end, float* boxes,
                 ScenePlan* plan) {
  constexpr int words = 3;  // of eight bytes, of a box
  __shared__ std::uint32_t counts[bins + 1];
  __shared__ float2 tile[words * block_threads];
  const int t = threadIdx.x;
  for (int bin = t; bin <= bins; bin += block_threads) counts[bin] = 0;
  const std::size_t stride = std::size_t{gridDim.x} * block_threads;
  for (std::size_t first = begin + blockIdx.x * std::size_t{block_threads}; first < end;
       first += stride) {
    const int count = static_cast<int>(min(end - first, std::size_t{block_threads}));
    const float2* const source = reinterpret_cast<const float2*>(from) + words * first;
    float2* const target = reinterpret_cast<float2*>(boxes) + words * first;
    float2 read[words];
#pragma unroll
    for (int k = 0; k < words; ++k)
      if (t + k * block_threads < words * count) read[k] = source[t + k * block_threads];
    __syncthreads();
#pragma unroll
    for (int k = 0; k < words; ++k) {
      const int i = t + k * block_threads;
      if (i >= words * count) break;
      tile[i] = read[k];
      if (from != boxes) target[i] = read[k];
    }
    __syncthreads();
    if (t >= count) continue;
    const Record box = loadBox(reinterpret_cast<const float*>(tile), t);
    atomicAdd(&counts[isActive(box) ? binOf(box) : bins], 1u);
  }
  __syncthreads();
  for (int bin = threadIdx.x; bin < bins; bin += block_threads)
    if (counts[bin]) atomicAdd(&plan->histogram[bin], counts[bin]);
  if (threadIdx.x == 0 && counts[bins]) atomicAdd(&plan->counters.inactive, counts[bins]);
}

// What the block that chooses the classes has in shared memory. Its threads are one an octave.
struct Choice {
  std::uint32_t octave_counts[octaves + class_octaves];
  bool taken[octaves + class_octaves];
  unsigned long long best[choose_threads / 32];
  Window windows[octaves];
  std::uint32_t shape_counts[most_windows + 1][shapes];
  std::uint8_t window_of_octave[octaves];
  std::uint8_t class_of_shape[most_windows + 1][shapes];
  int last_octave[most_classes + 1];
  int window_count, class_count;

  // Counts the octaves of the histogram; the steps below follow in their order.
  __device__ void clear(const std::uint32_t* histogram) {
    const int t = threadIdx.x;
    std::uint32_t count = 0;
    for (int shape = 0; shape < shapes; ++shape) count += histogram[t * shapes + shape];
    octave_counts[t] = count;
    taken[t] = t == unbounded_octave;
    if (t < class_octaves) {
      octave_counts[octaves + t] = 0;
      taken[octaves + t] = true;
    }
    window_of_octave[t] = no_window;
    if (t < (most_windows + 1) * shapes) shape_counts[t / shapes][t % shapes] = 0;
    if (t == 0) window_count = 0;
    __syncthreads();
  }
  // Takes windows of consecutive octaves, fullest first. At most 255 can be taken: each has an
  // octave of its own.
  __device__ void takeWindows() {
    const int t = threadIdx.x;
    for (;;) {
      std::uint32_t sum = 0;
      int last = t;
      for (; last < t + class_octaves && !taken[last]; ++last) sum += octave_counts[last];
      // The fullest; of equals the first.
      unsigned long long own = std::uint64_t{sum} << 16 | (255 - t) << 8 | (last - t);
      for (int step = 16; step; step /= 2) own = max(own, __shfl_xor_sync(all_lanes, own, step));
      if (t % 32 == 0) best[t / 32] = own;
      __syncthreads();
      own = best[0];
      for (int warp = 1; warp < choose_threads / 32; ++warp) own = max(own, best[warp]);
      if (own >> 16 == 0) break;
      const int first = 255 - static_cast<int>(own >> 8 & 0xff);
      const int end = first + static_cast<int>(own & 0xff);
      if (t >= first && t < end) taken[t] = true;
      if (t == 0) windows[window_count++] = {first, end - 1, static_cast<std::uint32_t>(own >> 16)};
      __syncthreads();
    }
  }
  // Joins windows (size_rules.h) and counts their shapes.
  __device__ void arrange(const std::uint32_t* histogram, std::uint32_t bounded) {
    const int t = threadIdx.x;
    if (t == 0) {
      window_count = arrangeWindows(windows, window_count, bounded);
      for (int i = 0; i < window_count; ++i)
        for (int octave = windows[i].first; octave <= windows[i].last; ++octave)
          window_of_octave[octave] = i;
    }
    __syncthreads();
    if (window_of_octave[t] != no_window)
      for (int shape = 0; shape < shapes; ++shape) {
        const std::uint32_t n = histogram[t * shapes + shape];
        if (n) atomicAdd(&shape_counts[window_of_octave[t]][shape], n);
      }
    __syncthreads();
  }
  // Returns the class of unbounded boxes, or no_class. By one thread.
  __device__ int split() {
    class_count = 0;
    for (int i = 0; i < window_count; ++i) {
      const int before = class_count;
      class_count = splitWindow(shape_counts[i], windows[i].count, window_count - 1 - i,
                                class_count, class_of_shape[i]);
      for (int of = before; of < class_count; ++of) last_octave[of] = windows[i].last;
    }
    if (!octave_counts[unbounded_octave]) return no_class;
    last_octave[class_count++] = unbounded_octave - 1;
    return class_count - 1;
  }

  static constexpr std::uint8_t no_window = 0xff;
};

// One block, one thread an octave.
__global__ void __launch_bounds__(choose_threads) chooseKernel(std::size_t boxes, ScenePlan* plan) {
  __shared__ Choice choice;
  const int t = threadIdx.x;
  choice.clear(plan->histogram);
  choice.takeWindows();
  const std::uint32_t active = static_cast<std::uint32_t>(boxes) - plan->counters.inactive;
  choice.arrange(plan->histogram, active - choice.octave_counts[unbounded_octave]);
  if (t == 0) {
    plan->unbounded = choice.split();
    plan->classes = choice.class_count;
    plan->active = active;
    plan->counters.cells = 0;
  }
  __syncthreads();
  for (int shape = 0; shape < shapes; ++shape) {
    const int window = choice.window_of_octave[t];
    plan->table[t * shapes + shape] = t == unbounded_octave ? choice.class_count - 1
                                      : window == Choice::no_window
                                          ? 0
                                          : choice.class_of_shape[window][shape];
  }
  if (t < choice.class_count) {
    // The largest extent is below 2^(last - 126).
    plan->unit[t] = fixed_point * exp2f(static_cast<float>(min(126 - choice.last_octave[t], 110)));
    ClassSummary& summary = plan->summary[t];
    for (int axis = 0; axis < 3; ++axis) {
      summary.low[axis] = ordered(INFINITY);
      summary.high[axis] = ordered(-INFINITY);
      summary.extent[axis] = 0;
    }
  }
}

// What a thread has seen of one class.
struct Run {
  int low[3], high[3];
  std::uint32_t extent[3], count;

  __device__ void clear() {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = ordered(INFINITY);
      high[axis] = ordered(-INFINITY);
      extent[axis] = 0;
    }
    count = 0;
  }
  __device__ void add(int axis, float lower, float upper, float unit) {
    const float centre = centreOf(lower, upper);
    if (isfinite(centre)) {
      low[axis] = min(low[axis], ordered(centre));
      high[axis] = max(high[axis], ordered(centre));
    }
    extent[axis] +=
        static_cast<std::uint32_t>(fminf(fmaxf((upper - lower) * unit, 0), fixed_point));
  }
  __device__ void addTo(ClassSummary& summary) const {
    for (int axis = 0; axis < 3; ++axis) {
      atomicMin(&summary.low[axis], low[axis]);
      atomicMax(&summary.high[axis], high[axis]);
      atomicAdd(&summary.extent[axis], static_cast<unsigned long long>(extent[axis]));
    }
  }
  // Adds what the lanes of a warp have seen last, each of the class `current` or, below 0, none:
  // joined first where they agree.
  __device__ void join(int current, ClassSummary* summaries) {
    const int common = warpMax(current);
    if (!__all_sync(all_lanes, current == common || current < 0)) {
      if (count) addTo(summaries[current]);
      return;
    }
    // 32 lanes times most_run times 2^16 would not fit: in two halves. The sum is exact, so that it
    // is the same however many threads there are.
    for (int axis = 0; axis < 3; ++axis) {
      const int least = warpMin(low[axis]), greatest = warpMax(high[axis]);
      const unsigned long long sum =
          warpSum(extent[axis] & 0xffff) +
          (static_cast<unsigned long long>(warpSum(extent[axis] >> 16)) << 16);
      if (threadIdx.x % 32 || common < 0) continue;
      atomicMin(&summaries[common].low[axis], least);
      atomicMax(&summaries[common].high[axis], greatest);
      atomicAdd(&summaries[common].extent[axis], sum);
    }
  }
};

// One thread a box, in strides. A thread collects while the class stays the same, a warp joins its
// lanes where they agree, a block its warps in shared memory. Classes are below most_classes by the
// table, bins below `bins`.
__global__ void __launch_bounds__(block_threads)
    summaryKernel(const float* boxes, std::size_t count, ScenePlan* plan) {
  __shared__ ClassSummary summaries[most_classes];
  __shared__ std::uint8_t table[bins];
  __shared__ float units[most_classes];
  const int t = threadIdx.x, classes = plan->classes;
  for (int bin = t; bin < bins; bin += block_threads) table[bin] = plan->table[bin];
  if (t < classes) {
    units[t] = plan->unit[t];
    summaries[t] = plan->summary[t];
    for (int axis = 0; axis < 3; ++axis) summaries[t].extent[axis] = 0;
  }
  __syncthreads();
  Run run;
  run.clear();
  int current = -1;
  const std::size_t stride = std::size_t{gridDim.x} * block_threads;
  for (std::size_t i = blockIdx.x * std::size_t{block_threads} + t; i < count; i += stride) {
    const Record box = loadBox(boxes, i);
    if (!isActive(box)) continue;
    const int own = table[binOf(box)];
    if (own != current || run.count == most_run) {
      if (run.count) run.addTo(summaries[current]);
      run.clear();
      current = own;
    }
    run.add(0, box.low.x, box.high.x, units[own]);
    run.add(1, box.low.y, box.high.y, units[own]);
    run.add(2, box.low.z, box.high.z, units[own]);
    ++run.count;
  }
  run.join(current, summaries);
  __syncthreads();
  if (t < classes * 3) {
    const int of = t / 3, axis = t % 3;
    if (summaries[of].low[axis] <= summaries[of].high[axis]) {
      atomicMin(&plan->summary[of].low[axis], summaries[of].low[axis]);
      atomicMax(&plan->summary[of].high[axis], summaries[of].high[axis]);
    }
    if (summaries[of].extent[axis])
      atomicAdd(&plan->summary[of].extent[axis], summaries[of].extent[axis]);
  }
}

// One thread a box, in strides; each block works out the curves for itself.
__global__ void __launch_bounds__(block_threads)
    keyKernel(const float* boxes, std::size_t count, int digits, const ScenePlan* plan,
              std::uint32_t* keys, std::uint32_t* slots) {
  __shared__ Curve curves[most_classes];
  __shared__ std::uint8_t table[bins];
  const int t = threadIdx.x;
  for (int bin = t; bin < bins; bin += block_threads) table[bin] = plan->table[bin];
  if (t < plan->classes)
    curves[t].choose(plan->summary[t].low, plan->summary[t].high, plan->summary[t].extent, digits);
  __syncthreads();
  if (t < plan->classes * 3) curves[t / 3].chooseSpread(t % 3, digits);
  __syncthreads();
  const int unbounded = plan->unbounded;
  const std::size_t stride = std::size_t{gridDim.x} * block_threads;
  for (std::size_t i = blockIdx.x * std::size_t{block_threads} + t; i < count; i += stride) {
    const Record box = loadBox(boxes, i);
    std::uint32_t key = no_key;
    if (isActive(box)) {
      const int own = table[binOf(box)];
      key = static_cast<std::uint32_t>(own) << curve_digits;
      if (own != unbounded) key |= curves[own].keyOf(box) << (curve_digits - digits);
    }
    keys[i] = key;
    slots[i] = static_cast<std::uint32_t>(i);
  }
}

}  // namespace

void clearPlan(ScenePlan* plan, cudaStream_t stream) {
  CHECK_CUDA(cudaMemsetAsync(plan, 0, offsetof(ScenePlan, table), stream));
}

void clearSearch(ScenePlan* plan, bool ignore_clusters, cudaStream_t stream) {
  CHECK_CUDA(cudaMemsetAsync(plan, 0, offsetof(ScenePlan, counters.inactive), stream));
  std::uint32_t* const clustered = &plan->counters.clustered;
  if (ignore_clusters) CHECK_CUDA(cudaMemsetAsync(clustered, 0, sizeof *clustered, stream));
}

void survey(const float* from, std::size_t begin, std::size_t end, float* boxes, ScenePlan* plan,
            const KernelQueue& queue) {
  launch("survey", surveyKernel, blocksFor(end - begin, queue), block_threads, queue.stream, from,
         begin, end, boxes, plan);
}

void assignKeys(const float* boxes, std::size_t count, ScenePlan* plan, std::uint32_t* keys,
                std::uint32_t* slots, const KernelQueue& queue) {
  const std::size_t blocks = blocksFor(count, queue);
  launch("choose classes", chooseKernel, 1, choose_threads, queue.stream, count, plan);
  launch("summarise classes", summaryKernel, blocks, block_threads, queue.stream, boxes, count,
         plan);
  launch("assign keys", keyKernel, blocks, block_threads, queue.stream, boxes, count,
         keyDigitsFor(count) - class_digits, plan, keys, slots);
}

}  // namespace device
}  // namespace ode_parallel_sap
