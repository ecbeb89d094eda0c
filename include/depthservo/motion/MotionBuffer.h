#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/Motion.h"
#include "depthservo/motion/OdometryRow.h"

namespace depthservo {

/// How far the odometry at hand covers a time interval.
enum class Coverage {
  complete,     ///< the whole interval
  hole,         ///< not a part of it: the rows before and after are too far apart
  ended,        ///< not its end: the newest row is too old for odometry that is only late
  refused,      ///< not a part of it: what was told of the motion then could not be used
  empty,        ///< there is no odometry at all
  beforeStart,  ///< it begins before the oldest row (never recorded, forgotten), or is too long
  afterEnd,     ///< the interval ends after the newest row has lost its validity: odometry is late
  reversed,     ///< the interval ends before it begins, or a time is not finite
};
DEPTHSERVO_API const char* toString(Coverage coverage);

/// Whether there is a motion to go on with, known (complete) or in part unknown (hole, ended,
/// refused).
inline bool hasMotion(Coverage coverage) { return coverage <= Coverage::refused; }

/// Timestamped odometry at any rate, and the camera motion between any two instants.
///
/// A row (time, twist) holds until the next row's time, unless `setMeaning` says otherwise. The
/// newest row is valid for one median period of the rows at hand (`nominalPeriod_s` while there is
/// only one). The motion over [t0, t1] is the product of exact exponentials, one for each row, the
/// first and the last cut at the ends of the interval. Times share one clock with the images; any
/// epoch.
///
/// Samples (`RowMeaning::instant`) are interpolated. Rows of `meanBefore` are lines with that mean
/// that rise as much as the mean has risen from the row before. Of both, the newest says how the
/// camera goes on until the next comes. How much the motion may
/// differ from that, given how much the twist changes from row to row, is in `Motion::within`: a
/// change by d at an unknown time in a period T.
///
/// Rows more than four median periods and 0.04 s apart leave a hole: the first holds for one median
/// period, and from there to the next row the motion is unknown (`Motion::unknown`). Likewise after
/// the newest row, once it is that old; until then its successor is only late (`afterEnd`).
///
/// Real-time: all memory is taken by the constructor. When full, the oldest row is forgotten.
class DEPTHSERVO_API MotionBuffer {
 public:
  /// \param capacity greatest number of rows kept, at least 2
  /// \param nominalPeriod_s how long a single row is valid [s], >= 0
  /// \param bounds of the camera's motion while it is unknown
  explicit MotionBuffer(std::size_t capacity = 1024, double nominalPeriod_s = 0,
                        const UnknownMotion& bounds = {});

  MotionBuffer(const MotionBuffer&) = default;  // no move: nothing is left without its memory
  MotionBuffer& operator=(const MotionBuffer&) = default;

  /// Adds a row. Refused (false, counted, nothing changed) when the time is not finite or not after
  /// the newest row's, or the twist is not usable (`Twist::isUsable`). \rtsafe
  bool push(double time_s, const Twist& twist);

  /// The newest row is known to hold until this time [s], or until the next row's if that comes
  /// first. \rtsafe
  void holdUntil(double time_s);

  /// From this time on [s] the motion is unknown, until the next row's time. Refused like `push`.
  /// \rtsafe
  bool pushUnknown(double time_s);

  /// What the rows mean, from the first one on: to be said before it.
  void setMeaning(RowMeaning meaning) { meaning_ = meaning; }

  const UnknownMotion& bounds() const { return bounds_; }
  void setBounds(const UnknownMotion& bounds) { bounds_ = bounds; }

  struct Interval {
    Motion motion;                        ///< the identity with dt = 0 unless `hasMotion`
    Coverage coverage = Coverage::empty;  ///< complete, or why the motion is not known
  };
  /// Camera motion from t0 to t1 [s], t0 <= t1. \rtsafe
  Interval motion(double t0_s, double t1_s) const;

  /// Whether the motion from t0 to t1 [s] is known. \rtsafe
  Coverage coverage(double t0_s, double t1_s) const { return known(t0_s, t1_s).coverage; }

  /// Since when [s] the motion has not been known, of the first part of the interval of which it is
  /// not: where a hole begins, or where the odometry ended. NaN unless the coverage is hole, ended
  /// or refused. \rtsafe
  double unknownSince(double t0_s, double t1_s) const { return known(t0_s, t1_s).unknownSince_s; }

  struct Mean {
    Twist twist;  ///< zero unless `coverage` is complete
    Coverage coverage = Coverage::empty;
  };
  /// Mean over time of the rows' twists from t0 to t1 [s], t0 < t1; each row in the camera frame of
  /// its own time. \rtsafe
  Mean meanTwist(double t0_s, double t1_s) const;

  /// How long a row holds at most where the next one is late [s]: rows farther apart leave a hole.
  static double longestHold(double medianPeriod_s);

  /// Whether rows say all they can of the motion up to this time [s]: they hold, or the newest is
  /// not older. Else the next one will say more. \rtsafe
  bool saysUntil(double time_s) const;

  /// End of the validity of the newest row [s]; meaningless when empty. \rtsafe
  double end() const;

  std::size_t size() const { return size_; }
  std::size_t refused() const { return refused_; }
  void clear();

 private:
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

  struct Row {
    double time_s = 0;
    Twist twist;  // of an unknown row: of the last known one before it
    bool isKnown = true;
    double heldUntil_s = -std::numeric_limits<double>::infinity();
  };
  struct Known {
    Coverage coverage = Coverage::empty;
    double unknownSince_s = kNaN;
  };
  const Row& row(std::size_t i) const {
    const std::size_t place = first_ + i;
    return rows_[place < rows_.size() ? place : place - rows_.size()];
  }
  bool add(const Row& row);
  double medianPeriod() const;
  double longestHold() const;
  double knownUntil(std::size_t i) const;
  Known known(double t0_s, double t1_s) const;
  bool isFollowed(std::size_t i) const;
  Motion partOf(std::size_t i, double from_s, double to_s) const;
  WithinRows within(std::size_t i, double from_s, double to_s) const;
  Vector6d changeIn(std::size_t i) const;
  Twist twistIn(std::size_t i, double from_s, double to_s) const;
  std::size_t rowAt(double time_s) const;
  template <class Part>
  void forEachPart(double t0_s, double t1_s, const Part& part) const;

  std::vector<Row> rows_;              // ring; row(0) is the oldest
  std::vector<double> sortedPeriods_;  // between consecutive rows at hand
  std::size_t first_ = 0, size_ = 0, refused_ = 0;
  double nominalPeriod_s_;
  RowMeaning meaning_ = RowMeaning::hold;
  UnknownMotion bounds_;
};

}  // namespace depthservo
