#include "cuda/several/deal.h"

#include <algorithm>

#include "cuda/several/shares.h"

namespace ode_parallel_sap {

using device::deal_slots;

static_assert(deal_slots == DealtRow::slots, "rows are the same on both sides");

void DealStream::reset() {
  taken_ = 0;
  opened_ = 0;
  lost_ = false;
  for (auto& written : written_) written = 0;
}

void DealStream::open(DeviceSweep& sweep, const BoxSet& boxes) {
  sweep_ = &sweep;
  with_bits_ = boxes.filter_bits;
  with_bodies_ = boxes.filter_bodies;
  while (gone_.size() < ring_pieces) gone_.push_back(std::make_unique<Event>());
  ring_.reserve(ring_pieces * piece_boxes);
  const std::size_t rows = (boxes.size + deal_slots - 1) / deal_slots;
  members_.reserve(rows * (deal_slots / 32));
  firsts_.reserve(rows);
  sweep.begin(boxes.size);
  Context& c = *sweep.context();
  c.slot_of.reserve(boxes.size);
  c.members.reserve(rows * (deal_slots / 32));
  c.first_boxes.reserve(rows);
  if (with_bits_) {
    bits_.reserve(ring_pieces * piece_boxes);
    c.bits.reserve(boxes.size);
    c.dealt_bits.reserve(boxes.size);
  }
  if (with_bodies_) {
    bodies_.reserve(ring_pieces * piece_boxes);
    c.bodies.reserve(boxes.size);
    c.dealt_bodies.reserve(boxes.size);
  }
  sent_ = in_use_ = 0;
  opened_.store(ring_pieces, std::memory_order_release);
}

void DealStream::write(const BoxSet& boxes, Slot first_slot, const std::uint16_t* at,
                       std::size_t count, std::size_t to) {
  const Box* const from = boxes.boxes.data() + first_slot;
  Box* const ring = ring_.data() + to;
  for (std::size_t i = 0; i < count; ++i) ring[i] = from[at[i]];
  if (with_bits_)
    for (std::size_t i = 0; i < count; ++i) bits_[to + i] = boxes.bits[first_slot + at[i]];
  if (with_bodies_)
    for (std::size_t i = 0; i < count; ++i) bodies_[to + i] = boxes.bodies[first_slot + at[i]];
}

void DealStream::send(std::size_t piece, std::size_t count) {
  Context& c = *sweep_->context();
  const std::size_t from = piece % ring_pieces * piece_boxes, to = piece * piece_boxes;
  const auto copy = [&](auto* target, const auto* source) {
    CHECK_CUDA(
        cudaMemcpyAsync(target, source, count * sizeof *source, cudaMemcpyHostToDevice, c.up));
  };
  copy(reinterpret_cast<Box*>(c.boxes.data()) + to, ring_.data() + from);
  if (with_bits_) copy(c.dealt_bits.data() + to, bits_.data() + from);
  if (with_bodies_) copy(c.dealt_bodies.data() + to, bodies_.data() + from);
  CHECK_CUDA(cudaEventRecord(*gone_[piece % ring_pieces], c.up));
  sweep_->arrived(to, to + count);
}

bool DealStream::drive(bool all_put) {
  // Places of the ring whose pieces have left.
  for (; in_use_ < sent_; ++in_use_) {
    const std::size_t place = in_use_ % ring_pieces;
    const cudaError_t status = cudaEventQuery(*gone_[place]);
    if (status == cudaErrorNotReady) break;
    CHECK_CUDA(status);
    written_[place].store(0, std::memory_order_relaxed);
    opened_.store(in_use_ + 1 + ring_pieces, std::memory_order_release);
  }
  for (; sent_ < in_use_ + ring_pieces; ++sent_) {
    std::size_t size = piece_boxes;
    if (all_put) size = std::min(size, boxes() - std::min(boxes(), sent_ * piece_boxes));
    if (size == 0) return true;
    if (written_[sent_ % ring_pieces].load(std::memory_order_acquire) < size) return false;
    send(sent_, size);
  }
  return all_put && sent_ * piece_boxes >= boxes();
}

void DealStream::finish(const BoxSet& boxes) {
  Context& c = *sweep_->context();
  const std::size_t rows = (boxes.size + deal_slots - 1) / deal_slots;
  const auto copy = [&](std::uint32_t* target, const std::uint32_t* source, std::size_t count) {
    CHECK_CUDA(
        cudaMemcpyAsync(target, source, count * sizeof *source, cudaMemcpyHostToDevice, c.up));
  };
  copy(c.members.data(), members_.data(), rows * (deal_slots / 32));
  copy(c.first_boxes.data(), firsts_.data(), rows);
  CHECK_CUDA(cudaEventRecord(c.filters_here, c.up));
  CHECK_CUDA(cudaStreamWaitEvent(c.compute, c.filters_here, 0));
  device::numberBoxes(c.members.data(), c.first_boxes.data(), boxes.size, c.slot_of.data(),
                      c.compute);
  if (this->boxes() == 0) return;
  if (with_bits_)
    device::spread(reinterpret_cast<const uint2*>(c.dealt_bits.data()), c.slot_of.data(),
                   this->boxes(), reinterpret_cast<uint2*>(c.bits.data()), c.compute);
  if (with_bodies_)
    device::spread(c.dealt_bodies.data(), c.slot_of.data(), this->boxes(), c.bodies.data(),
                   c.compute);
}

}  // namespace ode_parallel_sap
