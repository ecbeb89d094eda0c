#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/sequence/Sequence.h"
#include "text/TextTable.h"

namespace depthservo::detail {

constexpr double kSameTime_s = 1e-6;  // a double holds epoch seconds to 0.24 us

/// Rows of (timestamp, id) tables, grouped by time; each (timestamp, id) once.
template <class Value, class MakeValue>
std::vector<std::pair<double, std::vector<Value>>> readGroups(TextTable& table,
                                                              const MakeValue& make) {
  std::vector<std::pair<double, std::vector<Value>>> groups;
  while (table.next()) {
    const int id = table.id(1);
    if (groups.empty() || groups.back().first != table.time()) groups.push_back({table.time(), {}});
    auto& values = groups.back().second;
    const auto place = std::lower_bound(values.begin(), values.end(), id,
                                        [](const Value& v, int wanted) { return v.id < wanted; });
    if (place != values.end() && place->id == id) {
      table.fail(1, fmt::format("id {} appears twice at {} s; remove one row", id, table.time()));
    }
    values.insert(place, make(id));
  }
  return groups;
}

/// The frame at this time, or the place where it belongs.
inline std::vector<SequenceFrame>::iterator frameAt(std::vector<SequenceFrame>& frames,
                                                    double time_s) {
  return std::lower_bound(frames.begin(), frames.end(), time_s - kSameTime_s,
                          [](const SequenceFrame& f, double t) { return f.time_s < t; });
}

/// Gives each group to the frame of its time. Without images the groups make the frames; else
/// groups at other times are ignored, but for one file not all of them.
template <class Value>
void assignGroups(std::vector<std::pair<double, std::vector<Value>>> groups,
                  std::vector<Value> SequenceFrame::*member, bool hasImages,
                  const std::string& path, std::vector<SequenceFrame>& frames,
                  std::vector<std::string>& warnings) {
  std::size_t ignored = 0;
  if (!hasImages) {
    std::vector<SequenceFrame> merged;
    merged.reserve(frames.size() + groups.size());
    auto frame = frames.begin();
    for (const auto& group : groups) {
      while (frame != frames.end() && frame->time_s <= group.first + kSameTime_s) {
        merged.push_back(std::move(*frame++));
      }
      if (merged.empty() || merged.back().time_s < group.first - kSameTime_s) {
        merged.push_back({group.first, "", {}, {}});
      }
    }
    std::move(frame, frames.end(), std::back_inserter(merged));
    frames = std::move(merged);
  }
  for (auto& [time_s, values] : groups) {
    const auto frame = frameAt(frames, time_s);
    if (frame == frames.end() || frame->time_s > time_s + kSameTime_s ||
        !((*frame).*member).empty()) {
      ++ignored;
    } else {
      (*frame).*member = std::move(values);
    }
  }
  if (ignored == groups.size()) {
    throw InputError({path, 0, "timestamp"},
                     "no time is that of an image in rgb.txt; use the images' timestamps");
  }
  if (ignored > 0) {
    warnings.push_back(fmt::format("{}: {} of {} times are those of no image and are ignored", path,
                                   ignored, groups.size()));
  }
}

}  // namespace depthservo::detail
