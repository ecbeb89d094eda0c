#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/Velocities.h"

namespace depthservo {

/// Velocities that a robot shall have from now on, for a while.
struct CommandRow {
  std::uint64_t sequence = 0;  ///< 1, 2, ...: one that is not greater than the last is out of date
  double time_s = 0;           ///< when it was sent, of the clock that images and twists carry [s]
  double ttl_s = 0;            ///< time to live: the robot stops at time_s + ttl_s [s]
  double image_s = 0;          ///< time of the image that it follows from; NaN: of none [s]
  Velocities velocities;       ///< n
};

/// Lines `sequence,timestamp,ttl,image,...`, then the robot's own names: `v,w`. NaN stands as
/// "nan".
DEPTHSERVO_API std::string commandHeader(const std::vector<std::string>& velocityNames);
DEPTHSERVO_API std::string commandLine(const CommandRow& row);
/// None: not a command with n finite velocities and a time to live in (0, 10] s.
DEPTHSERVO_API std::optional<CommandRow> parseCommand(std::string_view line, Eigen::Index n);

/// The name of a velocity without its unit: "v" of "v [m/s]".
DEPTHSERVO_API std::string shortName(const std::string& velocityName);

namespace detail {
class LineStream;
class PipeWriter;
}  // namespace detail

/// Where the commands to a robot go.
class DEPTHSERVO_API CommandSink {
 public:
  virtual ~CommandSink() = default;

  /// At once and without waiting. False: it was not written, since nobody reads, or too slowly.
  virtual bool write(CommandRow row) noexcept = 0;

  /// Commands that nobody has taken yet, about; 0 where that cannot be known.
  virtual double unread() const { return 0; }
};

/// Commands in a pipe, a file or a socket.
class DEPTHSERVO_API CommandWriter : public CommandSink {
 public:
  /// \param path a named pipe (made where there is none), a file, "-" for standard output, or
  /// udp:ADDRESS:PORT \throw InputError
  CommandWriter(const std::string& path, const std::vector<std::string>& velocityNames);
  ~CommandWriter() override;

  /// Numbers the row first.
  bool write(CommandRow row) noexcept override;

  double unread() const override;
  std::uint64_t written() const { return sequence_; }

 private:
  std::unique_ptr<detail::PipeWriter> pipe_;
  std::string header_, line_;
  bool hasHeader_ = false;
  std::uint64_t sequence_ = 0;
};

/// Commands as the robot hears them. What is no command is counted and left out.
class DEPTHSERVO_API CommandReader {
 public:
  /// \param path a named pipe, a file, "-" for standard input, or udp:ADDRESS:PORT to listen at
  /// \throw InputError
  CommandReader(const std::string& path, Eigen::Index velocities);
  ~CommandReader();

  /// Those that have come since the last call, each later than the one before; waits up to `wait_s`
  /// for the first. Never throws.
  std::vector<CommandRow> read(double wait_s);

  /// Whether whoever commanded has gone.
  bool isEnded() const;

  std::size_t rows() const { return rows_; }
  std::size_t refused() const { return refused_; }

 private:
  std::unique_ptr<detail::LineStream> lines_;
  Eigen::Index velocities_;
  std::uint64_t last_ = 0;
  std::size_t rows_ = 0, refused_ = 0;
};

}  // namespace depthservo
