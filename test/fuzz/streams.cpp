// Streams of twists and of commands.
#include "Target.h"
#include "depthservo/sequence/CommandStream.h"
#include "depthservo/sequence/TwistStream.h"

namespace depthservo::fuzz {
namespace {

const Target kTwists("twists", [](const std::string& bytes) {
  TwistStream stream(written("twists", bytes));
  double last_s = -1e300;
  while (!stream.isEnded()) {
    for (const OdometryRow& row : stream.read(0)) {
      require(row.twist.isFinite() && row.time_s > last_s, "finite rows, each later");
      last_s = row.time_s;
    }
  }
  stream.takeFaults();
});

const Target kCommands("commands", [](const std::string& bytes) {
  CommandReader stream(written("commands", bytes), 2);
  while (!stream.isEnded()) {
    for (const CommandRow& row : stream.read(0)) {
      require(row.velocities.allFinite() && row.ttl_s > 0, "finite commands that end");
    }
  }
});

}  // namespace
}  // namespace depthservo::fuzz
