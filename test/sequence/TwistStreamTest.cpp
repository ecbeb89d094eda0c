#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "depthservo/sequence/TwistStream.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using test::inputErrorOf;
using test::isRefusal;

/// A pipe, and one end of it to write to.
class TwistPipe : public testing::Test {
 protected:
  TwistPipe() {
    path_ = folder_ / "twists";
    EXPECT_EQ(mkfifo(path_.c_str(), 0600), 0);
  }
  ~TwistPipe() override { hangUp(); }
  void write(const std::string& bytes) {
    if (end_ < 0) end_ = ::open(path_.c_str(), O_WRONLY | O_NONBLOCK);
    ASSERT_GE(end_, 0) << "nobody reads";
    ASSERT_EQ(::write(end_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  void hangUp() {
    if (end_ >= 0) close(end_);
    end_ = -1;
  }

  test::TemporaryFolder folder_;
  std::string path_;
  int end_ = -1;
};

TEST_F(TwistPipe, rows_come_as_they_were_written_whatever_the_pieces) {
  TwistStream stream(path_);
  write("timestamp,vx,vy,vz,wx,wy,wz\n# a comment\n\n1.5,1,2,3,4,");
  EXPECT_TRUE(stream.read(0).empty());
  write("5,-6e-1\r\n2, 0,0 ,0,0,0,0\n2.5,0,0,0,0,0,0");
  const auto rows = stream.read(0);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].time_s, 1.5);
  EXPECT_EQ(rows[0].twist.linear, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(rows[0].twist.angular, Eigen::Vector3d(4, 5, -0.6));
  write("\n");
  EXPECT_EQ(stream.read(0).size(), 1u);
  EXPECT_EQ(stream.counts().rows, 3u);
  EXPECT_EQ(stream.counts().refused(), 0u);
}

TEST_F(TwistPipe, rows_of_a_base_become_those_of_the_camera_on_it) {
  // Half a metre ahead of the base and looking ahead: x is the base's -y, y its -z, z its x.
  TwistStream stream(path_, RpyPose{{0.5, 0, 0}, {-M_PI / 2, 0, -M_PI / 2}});
  write("1,1,0,0,0,0,0.2\n");
  const auto rows = stream.read(0);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_LT((rows[0].twist.linear - Eigen::Vector3d(-0.1, 0, 1)).norm(), 1e-12);
  EXPECT_LT((rows[0].twist.angular - Eigen::Vector3d(0, -0.2, 0)).norm(), 1e-12);
}

TEST_F(TwistPipe, without_a_writer_or_with_a_silent_one_nothing_hangs) {
  TwistStream stream(path_);
  EXPECT_TRUE(stream.read(0.02).empty());
  EXPECT_FALSE(stream.isEnded()) << "the writer may be late";
  write("1,0,0,0,0,0,0\n");
  EXPECT_EQ(stream.read(0.02).size(), 1u);
  EXPECT_TRUE(stream.read(0.02).empty());
  EXPECT_FALSE(stream.isEnded());
}

TEST_F(TwistPipe, malformed_lines_are_counted_and_the_others_are_used) {
  TwistStream stream(path_);
  for (const char* line :
       {"rubbish", "1,2,3,4,5,6", "1,2,3,4,5,6,7,8", "1,nan,0,0,0,0,0", "1,inf,0,0,0,0,0",
        "1,1e9,0,0,0,0,0", ",,,,,,", "1;0;0;0;0;0;0", "\x01\xff\xfe", "nan,0,0,0,0,0,0"}) {
    write(std::string(line) + "\n");
  }
  write("1,0,0,0,0,0,0\n");
  EXPECT_EQ(stream.read(0).size(), 1u);
  EXPECT_EQ(stream.counts().malformed, 10u);
  const auto faults = stream.takeFaults();
  ASSERT_EQ(faults.size(), 10u);
  EXPECT_NE(faults[0].find("'rubbish'"), std::string::npos) << faults[0];
  EXPECT_TRUE(stream.takeFaults().empty());
}

TEST_F(TwistPipe, rows_that_are_not_later_are_counted) {
  TwistStream stream(path_);
  write("1,0,0,0,0,0,0\n1,0,0,0,0,0,0\n0.5,0,0,0,0,0,0\n2,0,0,0,0,0,0\n");
  EXPECT_EQ(stream.read(0).size(), 2u);
  EXPECT_EQ(stream.counts().notLater, 2u);
}

TEST_F(TwistPipe, a_line_that_its_writer_left_is_torn_and_the_next_writer_goes_on) {
  TwistStream stream(path_);
  write("1,0,0,0,0,0,0\n2,0,0,0,0,0,0.1");  // of 0.123?
  EXPECT_EQ(stream.read(0).size(), 1u);
  hangUp();
  EXPECT_TRUE(stream.read(0.02).empty());
  EXPECT_TRUE(stream.isEnded());
  EXPECT_EQ(stream.counts().torn, 1u);
  write("3,0,0,0,0,0,0\n");
  EXPECT_EQ(stream.read(0).size(), 1u);
  EXPECT_FALSE(stream.isEnded());
}

TEST_F(TwistPipe, an_endless_line_is_one_malformed_line) {
  TwistStream stream(path_);
  for (int i = 0; i < 40; ++i) {
    write(std::string(30000, '7'));
    EXPECT_TRUE(stream.read(0).empty());
  }
  write("\n1,0,0,0,0,0,0\n");
  EXPECT_EQ(stream.read(0).size(), 1u);
  EXPECT_EQ(stream.counts().malformed, 1u);
}

TEST_F(TwistPipe, a_file_may_end_without_an_end_of_line) {
  folder_.write("file.csv", "1,0,0,0,0,0,0\n2,0,0,0,0,0,0");
  TwistStream stream(folder_ / "file.csv");
  EXPECT_EQ(stream.read(1).size(), 2u);
  EXPECT_TRUE(stream.isEnded());
  EXPECT_EQ(stream.counts().torn, 0u);
}

TEST_F(TwistPipe, what_never_ends_is_read_in_portions) {
  TwistStream stream("/dev/zero");
  EXPECT_TRUE(stream.read(1).empty());
  EXPECT_EQ(stream.counts().malformed, 1u);
}

TEST_F(TwistPipe, what_cannot_be_read_is_refused) {
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { TwistStream(folder_ / "none"); }), {"none"}));
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { TwistStream{folder_.path()}; }), {"folder"}));
}

}  // namespace
}  // namespace depthservo
