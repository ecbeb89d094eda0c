#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "depthservo/report/Report.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/text/InputError.h"
#include "support/TemporaryFolder.h"
#include "support/exampleLog.h"

namespace depthservo {
namespace {

using test::TemporaryFolder;

RunLog filmedLog() {
  RunLog log = test::exampleLog();
  const auto width = static_cast<unsigned>(log.camera.width),
             height = static_cast<unsigned>(log.camera.height);
  for (const FrameRecord& frame : log.frames) {
    log.film.add(frame.time_s, DEPTHSERVO_VISP vpImage<unsigned char>(height, width, 90));
  }
  return log;
}

/// What a page says of itself in its title, after a script of ours has driven it, as soon as the
/// page and its frames are there. Empty: no browser.
std::string titleAfter(std::string page, const TemporaryFolder& place, const std::string& script) {
  if (std::system("command -v chromium > /dev/null 2>&1") != 0) return "";
  const std::string end = "</body>";
  page.insert(page.rfind(end),
              "<script>window.onerror = what => { document.title = 'error: ' + what; };\n"
              "window.addEventListener('load', () => { " +
                  script + " });</script>");
  place.write("page.html", page);
  const std::string command =
      "timeout 300 chromium --headless --no-sandbox --disable-gpu --window-size=1400,1000 "
      "--user-data-dir='" +
      (place / "browser").string() + "' --dump-dom 'file://" + (place / "page.html").string() +
      "' > '" + (place / "dom").string() + "' 2> /dev/null";
  if (std::system(command.c_str()) != 0) return "the browser failed";
  const std::string dom = place.read("dom");
  const std::size_t begin = dom.find("<title>") + 7;
  return dom.substr(begin, dom.find("</title>", begin) - begin);
}

std::string pageOf(const RunLog& log, const TemporaryFolder& place, const std::string& folder) {
  writeRunFolder(log, place / folder);
  return place.read(folder + "/report.html");
}

TEST(Player, page_has_pictures_of_the_run_and_where_its_points_are_expected) {
  const TemporaryFolder place;
  const std::string page = pageOf(filmedLog(), place, "run");
  const std::size_t begin = page.find(R"(id="film">)") + 10;
  const auto film =
      nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  ASSERT_GE(film.size(), 30u);
  EXPECT_LE(film.size(), 60u);
  for (std::size_t i = 1; i < film.size(); ++i) EXPECT_GT(film[i][0], film[i - 1][0]);
  EXPECT_EQ(film[0][1].get<std::string>().rfind("data:image/jpeg;base64,/9j/", 0), 0u);
  EXPECT_NE(page.find("\"sigma_uv\":["), std::string::npos);
  EXPECT_LT(page.size(), 10u << 20);
}

TEST(Player, folders_of_older_versions_still_have_a_report) {
  const TemporaryFolder place;
  writeRunFolder(test::exampleLog(), place / "run");
  std::string old;
  std::istringstream lines(place.read("run/features.csv"));
  for (std::string line; std::getline(lines, line);) old += line.substr(0, line.rfind(',')) + '\n';
  place.write("run/features.csv", old);
  EXPECT_NO_THROW(writeReport(place / "run"));
  EXPECT_NE(place.read("run/report.html").find("\"sigma_uv\":[null"), std::string::npos);
}

TEST(Player, a_film_of_something_else_is_refused) {
  const TemporaryFolder place;
  writeRunFolder(filmedLog(), place / "run");
  place.write("run/film/0.500000000.jpg", "not a picture");
  EXPECT_THROW(writeReport(place / "run"), InputError);
  std::filesystem::remove(place / "run/film/0.500000000.jpg");
  place.write("run/film/holiday.jpg", "\xFF\xD8");
  EXPECT_THROW(writeReport(place / "run"), InputError);
}

TEST(Player, keys_and_slider_move_one_moment_through_the_page) {
  const TemporaryFolder place;
  const std::string title = titleAfter(pageOf(filmedLog(), place, "run"), place, R"(
    const key = (name, more) => document.body.dispatchEvent(new KeyboardEvent('keydown', {key: name, bubbles: true, ...more}));
    const said = [], slider = document.getElementById('moment');
    const note = () => said.push(depthservo.row());
    note();
    key('Home'); note();
    key('ArrowRight'); note();
    key('ArrowRight', {shiftKey: true}); note();
    key('ArrowLeft'); note();
    slider.value = 50; slider.dispatchEvent(new Event('input')); note();
    said.push(document.getElementById('clock').textContent);
    said.push(document.querySelectorAll('.cursor').length === document.querySelectorAll('.chart-body').length);
    said.push(document.querySelector('#image-view > img:not([hidden])').src.startsWith('data:image/jpeg'));
    said.push(document.getElementById('scene').hidden);
    document.querySelector('#image-choice button').click();
    said.push(document.querySelector('#image-view > img:not([hidden])').id);
    key('End'); note();
    key(' '); said.push(document.getElementById('play').getAttribute('aria-label'));
    key(' '); said.push(document.getElementById('play').getAttribute('aria-label'));
    document.title = said.join(' ');)");
  if (title.empty()) GTEST_SKIP() << "no chromium";
  const std::string last = std::to_string(test::exampleLog().frames.size() - 1);
  EXPECT_EQ(title,
            last + " 0 1 11 10 50 1.67 s true true false image-first " + last + " pause play");
}

TEST(Player, page_says_how_far_from_its_goal_the_camera_is_and_numbers_the_events) {
  const TemporaryFolder place;
  const std::string title = titleAfter(pageOf(filmedLog(), place, "run"), place, R"(
    const figures = [...document.querySelectorAll('#figures dt')];
    const said = [figures.find(name => name.textContent === 'camera at the end').nextSibling.textContent];
    said.push([...document.querySelectorAll('#event-list .number')].map(number => number.textContent).join(','));
    said.push(document.getElementById('story').hidden);
    document.title = said.join(' | ');)");
  if (title.empty()) GTEST_SKIP() << "no chromium";
  EXPECT_EQ(
      title,
      "0.30 m and 1.72 deg from its goal: two velocities cannot reach a pose of three degrees "
      "of freedom; what is left shows little in the image | 1,2 | true")
      << "settles too slowly for a button";
}

TEST(Player, two_runs_side_by_side_share_the_moment) {
  const TemporaryFolder place;
  pageOf(filmedLog(), place, "one");
  pageOf(test::exampleReplay(), place, "other");
  writeReportOfTwo(place / "one", place / "other", place / "both.html");
  EXPECT_THROW(writeReportOfTwo(place / "one", place / "other", place / "both.html"), InputError);
  const std::string title = titleAfter(place.read("both.html"), place, R"(
    const {players, show, now} = depthservo, said = [players.length];
    const note = () => said.push(now().toFixed(1), ...players.map(player => player.row()));
    const run = document.getElementById('left').contentWindow.document;
    const key = (name, more, at = document.body) => at.dispatchEvent(new KeyboardEvent('keydown', {key: name, bubbles: true, ...more}));
    show(6);
    note();
    key('ArrowRight', {shiftKey: true}, run.body);
    note();
    const button = document.getElementById('play');
    for (let i = 0; i < 2; ++i) { key(' '); said.push(button.getAttribute('aria-label')); }
    key(' ', {}, run.querySelector('#image-choice button'));  // presses that one
    said.push(button.getAttribute('aria-label'));
    document.title = said.join(' ');)");
  if (title.empty()) GTEST_SKIP() << "no chromium";
  EXPECT_EQ(title, "2 6.0 180 180 7.0 210 210 pause play play");
}

}  // namespace
}  // namespace depthservo
