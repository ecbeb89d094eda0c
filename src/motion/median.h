#pragma once

#include <algorithm>
#include <vector>

namespace depthservo::detail {

/// The middle one of the values, of two the greater; reorders them. There must be some.
template <class T>
T medianOf(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median time from one row to the next [s]; 0 for fewer than two. \param timeOf of a row [s]
template <class Row, class TimeOf>
double medianPeriod(const std::vector<Row>& rows, const TimeOf& timeOf) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    periods.push_back(timeOf(rows[i]) - timeOf(rows[i - 1]));
  }
  return periods.empty() ? 0 : medianOf(periods);
}

}  // namespace depthservo::detail
