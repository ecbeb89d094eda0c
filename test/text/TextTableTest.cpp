#include <gtest/gtest.h>

#include <clocale>

#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"
#include "text/TextTable.h"

namespace depthservo::detail {
namespace {

using test::inputErrorOf;
using test::isRefusal;

class TextTableTest : public testing::Test {
 protected:
  std::vector<double> read(const std::string& content, TextTable::Style style) {
    folder_.write("t.csv", content);
    TextTable table(folder_ / "t.csv", style, {"timestamp", "id", "Z"},
                    TextTable::Order::notDecreasing);
    std::vector<double> values;
    while (table.next()) {
      values.insert(values.end(),
                    {table.time(), double(table.id(1)), table.number(2, {0, 10}, "m")});
    }
    return values;
  }
  std::vector<double> readCsv(const std::string& content) {
    return read(content, TextTable::Style::csv);
  }

  test::TemporaryFolder folder_;
};

TEST_F(TextTableTest, reads_comments_blank_lines_crlf_and_a_last_line_without_end) {
  const std::vector<double> expected = {1.5, 0, 2, 1.5, 1, 0.25};
  EXPECT_EQ(readCsv("timestamp,id,Z\n1.5,0,2\n1.5,1,.25\n"), expected);
  EXPECT_EQ(readCsv("\xEF\xBB\xBF# x\r\n\r\ntimestamp, id, Z\r\n 1.5 ,0,+2\r\n#\n1.5,1,25e-2"),
            expected);
  EXPECT_EQ(read("# time\n1.5 0 2\n\n1.5\t 1  0.25 \n", TextTable::Style::spaces), expected);
}

TEST_F(TextTableTest, takes_a_point_for_the_decimal_sign_in_every_locale) {
  const char* locale = std::setlocale(LC_ALL, "de_DE.UTF-8");
  EXPECT_EQ(readCsv("timestamp,id,Z\n1.5,0,2.25\n"), (std::vector<double>{1.5, 0, 2.25}));
  if (locale) std::setlocale(LC_ALL, "C");
}

TEST_F(TextTableTest, keeps_every_bit_of_a_number) {
  EXPECT_EQ(readCsv("timestamp,id,Z\n1305031102.175304,0,0.10000000000000002\n"),
            (std::vector<double>{1305031102.175304, 0, 0.10000000000000002}));
}

struct BrokenTable {
  const char* name;
  std::string content;
  std::vector<std::string> words;
};
void PrintTo(const BrokenTable& table, std::ostream* out) { *out << table.name; }

class BrokenTableTest : public TextTableTest, public testing::WithParamInterface<BrokenTable> {};

TEST_P(BrokenTableTest, is_refused_with_file_line_and_reason) {
  std::vector<std::string> words = GetParam().words;
  words.push_back("t.csv");
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { readCsv(GetParam().content); }), words));
}

const std::string kHeader = "timestamp,id,Z\n";
INSTANTIATE_TEST_SUITE_P(
    , BrokenTableTest,
    testing::Values(
        BrokenTable{"empty", "", {"empty", "timestamp,id,Z"}},
        BrokenTable{"comments_only", "# a\n\n", {"empty"}},
        BrokenTable{"header_only", kHeader, {"no row"}},
        BrokenTable{"no_header", "1,2,3\n", {":1:", "header"}},
        BrokenTable{"other_header", "timestamp,Z,id\n1,2,3\n", {":1:", "header"}},
        BrokenTable{"longer_header", "timestamp,id,Z,q\n1,2,3,4\n", {":1:", "header"}},
        BrokenTable{"nan", kHeader + "1,0,1\n2,0,nan\n", {":3: Z:", "finite", "[0, 10] m", "nan"}},
        BrokenTable{"inf", kHeader + "1,0,inf\n", {":2: Z:", "finite"}},
        BrokenTable{"time_nan", kHeader + "NaN,0,1\n", {":2: timestamp:"}},
        BrokenTable{"overflow", kHeader + "1,0,1e999\n", {":2: Z:"}},
        BrokenTable{"out_of_range", kHeader + "1,0,11\n", {":2: Z:", "[0, 10]", "11"}},
        BrokenTable{"word", kHeader + "1,0,far\n", {":2: Z:", "far"}},
        BrokenTable{"trailing_letter", kHeader + "1,0,1m\n", {":2: Z:", "1m"}},
        BrokenTable{"hexadecimal", kHeader + "1,0,0x1\n", {":2: Z:"}},
        BrokenTable{"decimal_comma", kHeader + "1,0,1,5\n", {":2:", "extra column"}},
        BrokenTable{"empty_cell", kHeader + "1,0,\n", {":2: Z:"}},
        BrokenTable{"missing_column", kHeader + "1,0\n", {":2: Z:", "missing column"}},
        BrokenTable{"cut_off", kHeader + "1,0,1\n2,", {":3: Z:", "missing column"}},
        BrokenTable{"extra_column", kHeader + "1,0,1,1\n", {":2:", "extra column"}},
        BrokenTable{"fraction_as_id", kHeader + "1,0.5,1\n", {":2: id:", "whole"}},
        BrokenTable{"negative_id", kHeader + "1,-1,1\n", {":2: id:"}},
        BrokenTable{"huge_id", kHeader + "1,99999999999999999999,1\n", {":2: id:"}},
        BrokenTable{"backwards", kHeader + "2,0,1\n1,0,1\n", {":3: timestamp:", "backwards"}},
        BrokenTable{"nanoseconds", kHeader + "1305031102175304000,0,1\n", {":2:", "nanoseconds"}},
        BrokenTable{"binary", kHeader + std::string("1,0,\0\x01", 6), {":2:", "not a text file"}},
        BrokenTable{"not_utf8", kHeader + "1,0,\xff\n", {":2:", "not a text file"}},
        BrokenTable{"megabyte_line", kHeader + std::string(1 << 20, '1'), {":2:", "longer"}}),
    [](const auto& param) { return std::string(param.param.name); });

TEST_F(TextTableTest, asks_for_the_unit_that_the_size_of_a_time_suggests) {
  const auto refusal = [&](const std::string& time) {
    return inputErrorOf([&] { readCsv(kHeader + time + ",0,1\n"); });
  };
  EXPECT_TRUE(isRefusal(refusal("1700000000123"), {":2: timestamp", "is it milliseconds?"}));
  EXPECT_TRUE(isRefusal(refusal("1700000000123456"), {":2: timestamp", "is it microseconds?"}));
  EXPECT_TRUE(isRefusal(refusal("1.7e18"), {":2: timestamp", "is it nanoseconds?"}));
  EXPECT_EQ(refusal("-1e12").find("is it"), std::string::npos);
}

TEST_F(TextTableTest, of_spaces_may_have_commas_or_semicolons_line_by_line) {
  const std::vector<double> expected = {1.5, 0, 2, 1.5, 1, 0.25};
  for (const char* content :
       {"1.5,0,2\n1.5,1,0.25\n", "1.5, 0, 2\n1.5 , 1 , 0.25\n", "1.5;0;2\n1.5; 1 ;0.25\n",
        "1.5 0 2\n1.5\t,1,.25\n", "# Zeit; id; Z\r\n1.5;0;2\r\n1.5 1 0.25\r\n",
        "timestamp,id,Z\n1.5,0,2\n1.5,1,.25\n", "timestamp id Z [m]\n1.5 0 2\n1.5 1 .25\n"}) {
    EXPECT_EQ(read(content, TextTable::Style::spaces), expected) << content;
  }
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { read("1,5 0 2\n", TextTable::Style::spaces); }),
                        {":1:", "missing column"}));
}

TEST_F(TextTableTest, of_spaces_may_have_commas_in_a_path) {
  folder_.write("t.csv", "1 a,b.png\n2,c d.png\n");
  TextTable table(folder_ / "t.csv", TextTable::Style::spaces, {"timestamp", "path"});
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.text(1), "a,b.png");
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.text(1), "c d.png");
}

TEST_F(TextTableTest, understands_the_order_of_poses_in_any_header) {
  const auto refusal = [&](const std::string& header) {
    folder_.write("t.csv", header + "\n0 0 0 0 0 0 0 1\n");
    return inputErrorOf([&] {
      TextTable table(folder_ / "t.csv", TextTable::Style::spaces,
                      {"timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"});
      table.next();
    });
  };
  for (const char* header :
       {"# time x y z w x y z", "#time,px,py,pz,rw,rx,ry,rz",
        "# t [s] p_x [m] p_y [m] p_z [m] Q_W [] Q_X [] Q_Y [] Q_Z []",
        "# stamp position.x position.y position.z orientation.w orientation.x orientation.y "
        "orientation.z",
        "# t qx qy qz qw tx ty tz", "# t tx ty tz q0 q1 q2 q3", "# t x y z qr qi qj qk",
        "time;tx;ty;tz;qw;qx;qy;qz",
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], "
        "q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"}) {
    EXPECT_TRUE(isRefusal(refusal(header), {"t.csv:1:", "order", "qx qy qz qw"})) << header;
  }
  for (const char* header :
       {"# timestamp tx ty tz qx qy qz qw", "# t[s], x(m), y(m), z(m), q_x, q_y, q_z, q_w",
        "# poses of the camera, w last", "# t x y z qi qj qk qr", "time tx ty tz qx qy qz qw"}) {
    EXPECT_EQ(refusal(header), "") << header;
  }
}

TEST_F(TextTableTest, refuses_equal_times_where_time_must_increase) {
  folder_.write("t.csv", "1 a\n1 b\n");
  TextTable table(folder_ / "t.csv", TextTable::Style::spaces, {"timestamp", "path"});
  EXPECT_TRUE(table.next());
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { table.next(); }), {"t.csv:2:", "twice"}));
}

TEST_F(TextTableTest, refuses_what_is_not_a_file) {
  const auto open = [](const std::string& path) {
    return inputErrorOf([&] { TextTable(path, TextTable::Style::spaces, {"timestamp"}); });
  };
  EXPECT_TRUE(isRefusal(open(folder_ / "none"), {"none", "no such file"}));
  EXPECT_TRUE(isRefusal(open(folder_.path()), {"folder"}));
  EXPECT_TRUE(isRefusal(open("/dev/zero"), {"/dev/zero", "regular"}));
}

}  // namespace
}  // namespace depthservo::detail
