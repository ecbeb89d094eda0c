#include "depthservo/depth/SeparatePoints.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "depth/findById.h"

namespace depthservo {

SeparatePoints::SeparatePoints(const PointSetEstimator& prototype, std::size_t capacity,
                               const DepthPrior& prior)
    : slots_(std::max<std::size_t>(capacity, 1)), prior_(prior) {
  for (Slot& slot : slots_) slot.estimator = prototype.clone();
  one_.reserve(1);
}

SeparatePoints::SeparatePoints(const SeparatePoints& other)
    : PointSetEstimator(other),
      slots_(other.slots_.size()),
      size_(other.size_),
      prior_(other.prior_),
      time_s_(other.time_s_) {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const Slot& from = other.slots_[i];
    slots_[i] = {from.id, from.isSeen, from.estimator->clone()};
  }
  one_.reserve(1);
}

std::unique_ptr<PointSetEstimator> SeparatePoints::clone() const {
  return std::make_unique<SeparatePoints>(*this);
}

void SeparatePoints::reset() {
  size_ = 0;
  time_s_ = std::numeric_limits<double>::quiet_NaN();
  for (Slot& slot : slots_) slot.estimator->reset();
}

const SeparatePoints::Slot* SeparatePoints::find(int id) const {
  return detail::findById(slots_, size_, id);
}

SeparatePoints::Slot* SeparatePoints::findOrAdd(int id) {
  if (Slot* known = detail::findById(slots_, size_, id)) return known;
  if (size_ == slots_.size()) return nullptr;
  Slot& slot = slots_[size_++];
  slot.id = id;
  slot.isSeen = false;
  slot.estimator->reset();
  slot.estimator->setPrior(id, prior_);
  if (!std::isnan(time_s_)) slot.estimator->advance(none_, time_s_);
  return &slot;
}

bool SeparatePoints::setPrior(int id, const DepthPrior& prior) {
  Slot* slot = findOrAdd(id);
  return slot && slot->estimator->setPrior(id, prior);
}

bool SeparatePoints::retire(int id) {
  Slot* known = detail::findById(slots_, size_, id);
  if (!known) return false;
  known->estimator->reset();  // its place says nothing of it any more
  std::swap(*known, slots_[--size_]);
  return true;
}

Coverage SeparatePoints::advance(const MotionBuffer& odometry, double time_s) {
  if (std::isnan(time_s_) && !std::isfinite(time_s)) return Coverage::reversed;
  const Coverage coverage =
      std::isnan(time_s_) ? Coverage::complete : odometry.coverage(time_s_, time_s);
  if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) return coverage;
  for (std::size_t i = 0; i < size_; ++i) slots_[i].estimator->advance(odometry, time_s);
  time_s_ = time_s;
  return coverage;
}

void SeparatePoints::correct(const std::vector<PointObservation>& observations) {
  for (std::size_t i = 0; i < size_; ++i) slots_[i].isSeen = false;
  for (const PointObservation& observation : observations) {
    Slot* slot = findOrAdd(observation.id);
    if (!slot) continue;
    slot->isSeen = true;
    one_.assign(1, observation);
    slot->estimator->correct(one_);
  }
  one_.clear();
  for (std::size_t i = 0; i < size_; ++i) {
    if (!slots_[i].isSeen) slots_[i].estimator->correct(one_);
  }
}

void SeparatePoints::correctDepth(int id, const DepthPrior& measured) {
  Slot* known = detail::findById(slots_, size_, id);
  if (known) known->estimator->correctDepth(id, measured);
}

void SeparatePoints::setNoise(const MeasurementNoise& noise) {
  for (Slot& slot : slots_) slot.estimator->setNoise(noise);
}

DepthEstimate SeparatePoints::estimate(int id) const {
  const Slot* slot = find(id);
  return (slot ? *slot : slots_.front()).estimator->estimate(id);
}

}  // namespace depthservo
