#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <cmath>
#include <limits>

#include "depthservo/sequence/CommandStream.h"
#include "depthservo/text/InputError.h"
#include "support/Random.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

CommandRow row(double v, double w) {
  CommandRow row;
  row.time_s = 1764266349.123456789;
  row.ttl_s = 0.2;
  row.image_s = 1764266349.1;
  row.velocities = Eigen::Vector2d(v, w);
  return row;
}

TEST(CommandStream, a_line_is_read_as_it_was_written) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    CommandRow before = row(random.normal(1), random.normal(1e-9));
    before.sequence = 1 + static_cast<std::uint64_t>(i);
    if (i % 3 == 0) before.image_s = std::numeric_limits<double>::quiet_NaN();
    const auto after = parseCommand(commandLine(before), 2);
    ASSERT_TRUE(after) << commandLine(before);
    EXPECT_EQ(after->sequence, before.sequence);
    EXPECT_NEAR(after->time_s, before.time_s, 1e-6);
    EXPECT_EQ(after->velocities, before.velocities);
    EXPECT_EQ(std::isnan(after->image_s), std::isnan(before.image_s));
  }
}

TEST(CommandStream, the_header_has_the_robots_own_names) {
  EXPECT_EQ(commandHeader({"v [m/s]", "w [rad/s]"}), "sequence,timestamp,ttl,image,v,w");
  EXPECT_EQ(commandHeader({"vx [m/s]", "vy [m/s]", "w [rad/s]"}),
            "sequence,timestamp,ttl,image,vx,vy,w");
}

TEST(CommandStream, what_is_no_command_is_not_read) {
  EXPECT_TRUE(parseCommand("1,2,0.2,nan,0.1,0.2", 2));
  for (const char* line :
       {"", "1,2,0.2,nan,0.1", "1,2,0.2,nan,0.1,0.2,0.3", "0,2,0.2,nan,0.1,0.2",
        "-1,2,0.2,nan,0.1,0.2", "1.5,2,0.2,nan,0.1,0.2", "1,nan,0.2,nan,0.1,0.2",
        "1,2,0,nan,0.1,0.2", "1,2,-1,nan,0.1,0.2", "1,2,1e9,nan,0.1,0.2", "1,2,0.2,inf,0.1,0.2",
        "1,2,0.2,nan,nan,0.2", "1,2,0.2,nan,inf,0.2", "1,2,0.2,nan,1e9,0.2", "1,2,0.2,nan,,0.2",
        "1,2,0.2,nan,0.1,0x1p3", "1,2,0.2,x,0.1,0.2", "rubbish"}) {
    EXPECT_FALSE(parseCommand(line, 2)) << line;
  }
}

class CommandPipe : public testing::Test {
 protected:
  CommandPipe() {
    signal(SIGPIPE, SIG_IGN);
    EXPECT_EQ(mkfifo(path_.c_str(), 0600), 0);
  }
  TemporaryFolder folder_;
  std::string path_ = folder_ / "commands";
};

TEST_F(CommandPipe, brings_commands_in_their_order) {
  CommandReader reader(path_, 2);
  CommandWriter writer(path_, {"v [m/s]", "w [rad/s]"});
  EXPECT_TRUE(reader.read(0).empty());
  EXPECT_TRUE(writer.write(row(0.1, 0)));
  EXPECT_TRUE(writer.write(row(0.2, 0)));
  EXPECT_NEAR(writer.unread(), 2, 1);
  const auto rows = reader.read(0);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].sequence, 2u);
  EXPECT_EQ(rows[1].velocities[0], 0.2);
  EXPECT_EQ(writer.unread(), 0);
  EXPECT_EQ(reader.refused(), 0u);
}

TEST_F(CommandPipe, without_a_reader_writes_nothing_and_does_not_wait) {
  CommandWriter writer(path_, {"v [m/s]"});
  EXPECT_FALSE(writer.write(row(0.1, 0)));
  {
    CommandReader reader(path_, 2);
    EXPECT_TRUE(writer.write(row(0.1, 0)));
  }
  EXPECT_FALSE(writer.write(row(0.1, 0))) << "its reader has gone";
}

TEST_F(CommandPipe, a_reader_that_sleeps_does_not_hold_the_writer) {
  CommandReader reader(path_, 2);
  CommandWriter writer(path_, {"v [m/s]", "w [rad/s]"});
  int written = 0;
  while (written < 100000 && writer.write(row(0.1, 0))) ++written;
  EXPECT_LT(written, 100000);
  EXPECT_GT(writer.unread(), 100);
  std::size_t read = 0;
  for (int i = 0; i < 10; ++i) read += reader.read(0).size();
  EXPECT_GE(read, static_cast<std::size_t>(written)) << "those that were written are whole";
  EXPECT_EQ(reader.refused(), 0u);
}

TEST_F(CommandPipe, its_end_is_told_and_another_may_command) {
  CommandReader reader(path_, 2);
  for (int i = 0; i < 2; ++i) {
    {
      CommandWriter writer(path_, {"v [m/s]", "w [rad/s]"});
      writer.write(row(0.1, 0));
      EXPECT_EQ(reader.read(0).size(), 1u) << "sequences begin anew after a header";
      EXPECT_FALSE(reader.isEnded());
    }
    reader.read(0);
    EXPECT_TRUE(reader.isEnded());
  }
}

TEST(CommandUdp, brings_commands_on_loopback) {
  CommandReader reader("udp:127.0.0.1:45107", 2);
  CommandWriter writer("udp:127.0.0.1:45107", {"v [m/s]", "w [rad/s]"});
  EXPECT_TRUE(writer.write(row(0.3, 0.1)));
  const auto rows = reader.read(1);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].velocities[0], 0.3);
}

TEST(CommandUdp, refuses_an_address_that_is_none) {
  for (const char* path :
       {"udp:", "udp:127.0.0.1", "udp:127.0.0.1:0", "udp:127.0.0.1:99999", "udp:somewhere:5005"}) {
    EXPECT_THROW(CommandReader(path, 2), InputError) << path;
  }
}

}  // namespace
}  // namespace depthservo::test
