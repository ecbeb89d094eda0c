#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/sequence/TwistSource.h"
#include "depthservo/sequence/VideoSource.h"

namespace depthservo {

/// Images that a program hands over as they come, from any thread: those of a message, say.
class DEPTHSERVO_API PushedImages : public ImageSource {
 public:
  struct Options {
    std::size_t most = 1;  ///< that wait; the oldest is left out for a newer one
    /// They are not of now: images wait for their odometry as those of a file do.
    bool isPlayback = false;
    double silence_s = 0;  ///< without an image for so long they have ended; 0: they wait for ever
    double rate = 0;       ///< images per second, 0: not known [Hz]
  };
  explicit PushedImages(const Options& options) : options_(options) {}

  void push(TimedImage image);
  /// No more will come: those that wait are given, then it is the end.
  void end(const std::string& reason);

  ImageStatus next(TimedImage& image) override;
  std::string reason() const override;
  bool isLive() const override { return !options_.isPlayback; }
  double fps() const override { return options_.rate; }
  std::size_t leftOut() const override;

 private:
  Options options_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<TimedImage> images_;
  std::size_t leftOut_ = 0;
  bool isEnded_ = false;
  std::string reason_;
};

/// Twists that a program hands over as they come, from any thread.
class DEPTHSERVO_API PushedTwists : public TwistSource {
 public:
  /// One that is not finite, or not later than the one before, is counted and left out.
  void push(const OdometryRow& row);
  void end();

  std::vector<OdometryRow> read(double wait_s) override;
  bool isEnded() const override;
  /// Of the rows handed over by `read`, and of those refused until then.
  const Counts& counts() const override { return told_; }
  std::vector<std::string> takeFaults() override;

 private:
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<OdometryRow> rows_;
  double last_s_ = -1e300;
  bool isEnded_ = false;
  Counts counts_, told_;
  std::vector<std::string> faults_;
};

}  // namespace depthservo
