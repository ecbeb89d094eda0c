#pragma once

#include <cstddef>
#include <vector>

namespace depthservo {

/// Which moments of a run a page shows. Long runs are thinned: the first and the last image stand
/// for themselves; of the others, each two rows stand for a bucket of images of equal length.
class TimeRows {
 public:
  /// \param most rows, at least 4
  TimeRows(std::size_t frames, std::size_t most);

  std::size_t size() const { return frames_.size(); }
  /// The frame whose time a row shows; increasing.
  std::size_t frameOf(std::size_t row) const { return frames_[row]; }
  /// Images that two rows stand for; 1: every image has a row.
  std::size_t bucket() const { return bucket_; }

  /// The rows that a frame counts for: equal when it stands for itself.
  struct Place {
    std::size_t first, second;
  };
  Place placeOf(std::size_t frame) const;

 private:
  std::size_t count_, bucket_ = 1;
  std::vector<std::size_t> frames_;
};

/// What a column shows of the images of a bucket.
enum class Shown {
  extremes,  ///< the lowest and the highest, in the order in which they came
  lowest,
  highest,
  sample,  ///< the value at the row's own frame
};

/// A column of a page, filled frame by frame; unknown (NaN) where nothing was added.
class ThinnedColumn {
 public:
  ThinnedColumn(const TimeRows& rows, Shown shown);

  /// \param frame not below that of the last call
  void add(std::size_t frame, double value);
  const std::vector<double>& values() const { return values_; }

 private:
  const TimeRows* rows_;
  Shown shown_;
  std::vector<double> values_;
};

}  // namespace depthservo
