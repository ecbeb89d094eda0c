#include "depthservo/depth/PointwiseEstimator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "depth/findById.h"

namespace depthservo {

DepthEstimate PointSetEstimator::estimate(int id, const MotionBuffer& odometry,
                                          double time_s) const {
  const DepthEstimate last = estimate(id);
  if (last.status == DepthStatus::unset) return last;
  const auto [motion, coverage] = odometry.motion(time(), time_s);
  return hasMotion(coverage) ? predicted(last, motion, range()) : last;
}

PointwiseEstimator::PointwiseEstimator(const DepthEstimator& prototype, std::size_t capacity,
                                       const DepthPrior& prior, const DepthRange& range)
    : slots_(capacity), prior_(prior), range_(range) {
  for (Slot& slot : slots_) slot.estimator = prototype.clone();
}

PointwiseEstimator::PointwiseEstimator(const PointwiseEstimator& other)
    : PointSetEstimator(other),
      slots_(other.slots_.size()),
      size_(other.size_),
      ignored_(other.ignored_),
      prior_(other.prior_),
      range_(other.range_),
      time_s_(other.time_s_) {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const Slot& from = other.slots_[i];
    slots_[i] = {from.id, from.started, from.prior, from.estimator->clone()};
  }
}

std::unique_ptr<PointSetEstimator> PointwiseEstimator::clone() const {
  return std::make_unique<PointwiseEstimator>(*this);
}

void PointwiseEstimator::reset() {
  size_ = ignored_ = 0;
  time_s_ = std::numeric_limits<double>::quiet_NaN();
}

const PointwiseEstimator::Slot* PointwiseEstimator::find(int id) const {
  return detail::findById(slots_, size_, id);
}

PointwiseEstimator::Slot* PointwiseEstimator::find(int id) {
  return detail::findById(slots_, size_, id);
}

PointwiseEstimator::Slot* PointwiseEstimator::findOrAdd(int id) {
  if (Slot* known = find(id)) return known;
  if (size_ == slots_.size()) return nullptr;
  Slot& slot = slots_[size_++];
  slot.id = id;
  slot.started = false;
  slot.prior = prior_;
  return &slot;
}

bool PointwiseEstimator::setPrior(int id, const DepthPrior& prior) {
  Slot* slot = findOrAdd(id);
  if (!slot) return false;
  slot->prior = prior;
  slot->started = false;
  return true;
}

bool PointwiseEstimator::retire(int id) {
  Slot* slot = find(id);
  if (!slot) return false;
  std::swap(*slot, slots_[--size_]);
  return true;
}

Coverage PointwiseEstimator::advance(const MotionBuffer& odometry, double time_s) {
  if (std::isnan(time_s_)) {  // the first image: nothing to move yet
    if (!std::isfinite(time_s)) return Coverage::reversed;
    time_s_ = time_s;
    return Coverage::complete;
  }
  const auto [motion, coverage] = odometry.motion(time_s_, time_s);
  switch (coverage) {
    case Coverage::afterEnd:
    case Coverage::reversed:
      return coverage;
    case Coverage::complete:
    case Coverage::hole:
    case Coverage::ended:
    case Coverage::refused:
      for (std::size_t i = 0; i < size_; ++i) slots_[i].estimator->predict(motion);
      break;
    case Coverage::empty:
    case Coverage::beforeStart:
      for (std::size_t i = 0; i < size_; ++i) {
        if (slots_[i].started) slots_[i].prior = {slots_[i].estimator->estimate().Z()};
        slots_[i].started = false;
      }
      break;
  }
  time_s_ = time_s;
  return coverage;
}

void PointwiseEstimator::correct(const std::vector<PointObservation>& observations) {
  for (const PointObservation& observation : observations) {
    Slot* slot = findOrAdd(observation.id);
    if (!slot) {
      ++ignored_;
    } else if (slot->started) {
      slot->estimator->correct(observation.measurement);
    } else if (observation.measurement.isUsable()) {
      slot->estimator->reset(observation.measurement, slot->prior);
      slot->started = true;
    }
  }
}

void PointwiseEstimator::correctDepth(int id, const DepthPrior& measured) {
  Slot* slot = find(id);
  if (slot && slot->started) slot->estimator->correctDepth(measured);
}

DepthEstimate PointwiseEstimator::estimate(int id) const {
  const Slot* slot = find(id);
  if (slot && slot->started) return slot->estimator->estimate();
  const DepthPrior prior = (slot ? slot->prior : prior_).sanitised(range_);
  DepthEstimate unset;
  unset.chi = 1 / prior.Z;
  unset.sigma_chi = prior.sigma_chi;
  return unset;
}

}  // namespace depthservo
