#include "report/joinedEvents.h"

#include <algorithm>
#include <map>
#include <regex>

namespace depthservo {
namespace {

/// "dot 3 hidden" is of the kind "dots hidden"; what it says of which points is left out.
std::string kindOf(const std::string& what) {
  static const std::regex list(R"( \(points? [0-9, ]+\))");
  static const std::regex one(R"(\b(point|dot|corner|tag) [0-9]+)");
  return std::regex_replace(std::regex_replace(what, list, ""), one, "$1s");
}

}  // namespace

std::vector<JoinedEvents> joined(const std::vector<Event>& events, std::size_t apart) {
  std::map<std::string, std::vector<const Event*>> kinds;
  for (const Event& event : events) kinds[kindOf(event.what)].push_back(&event);
  std::vector<JoinedEvents> all;
  for (const auto& [kind, same] : kinds) {
    if (same.size() <= apart) {
      for (const Event* event : same) all.push_back({event->what, 1, event->time_s, event->time_s});
      continue;
    }
    const std::string& what = same.front()->what;
    const bool isEqual = std::all_of(same.begin(), same.end(),
                                     [&](const Event* event) { return event->what == what; });
    const auto [first, last] =
        std::minmax_element(same.begin(), same.end(),
                            [](const Event* a, const Event* b) { return a->time_s < b->time_s; });
    all.push_back({isEqual ? what : kind, same.size(), (*first)->time_s, (*last)->time_s});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.first_s < b.first_s; });
  return all;
}

}  // namespace depthservo
