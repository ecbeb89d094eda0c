#pragma once

#include <fmt/format.h>
#include <rapidcheck.h>

#include <array>
#include <cmath>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/Random.h"

namespace depthservo::test {

/// A call of one of an object's methods, with arguments that may be anything.
struct Call {
  std::size_t method = 0;
  int id = 0;
  std::array<double, 7> v{};
};
using Calls = std::vector<Call>;

/// An object whose methods may be called in any order with any arguments.
class Callable {
 public:
  struct Method {
    const char* name;
    std::size_t numbers;  ///< of Call::v that it takes
    bool hasId;
  };
  virtual ~Callable() = default;
  virtual const std::vector<Method>& methods() const = 0;

  /// Does it. \return what of the promises does not hold then; empty: all do
  virtual std::string call(const Call& call) = 0;
};
using MakeCallable = std::function<std::unique_ptr<Callable>()>;

/// The first promise that is broken; empty: none is.
inline std::string faultOf(const MakeCallable& make, const Calls& calls) try {
  const auto object = make();
  for (const Call& call : calls) {
    const std::string fault = object->call(call);
    if (!fault.empty()) return fault;
  }
  return "";
} catch (const std::exception& thrown) {
  return fmt::format("throws {}", thrown.what());
}

/// Numbers that are simpler to read, of which each has fewer than this one.
inline rc::Seq<Call> simpler(const Call& call) {
  static const std::vector<double> simplest{0, 1, -1, 0.1};
  std::vector<Call> all;
  const auto rank = [&](double v) {
    for (std::size_t i = 0; i < simplest.size(); ++i) {
      if (v == simplest[i]) return i;
    }
    return simplest.size() + (std::isfinite(v) && v == std::stod(fmt::format("{:.1g}", v)) ? 0 : 1);
  };
  const auto add = [&](std::size_t i, double v) {
    if (rank(v) >= rank(call.v[i])) return;
    all.push_back(call);
    all.back().v[i] = v;
  };
  for (std::size_t i = 0; i < call.v.size(); ++i) {
    for (const double v : simplest) add(i, v);
    if (std::isfinite(call.v[i])) add(i, std::stod(fmt::format("{:.1g}", call.v[i])));
  }
  if (call.id != 0) {
    all.push_back(call);
    all.back().id = 0;
  }
  return rc::seq::fromContainer(all);
}

/// The shortest sequence that breaks a promise, found by leaving out calls and simplifying numbers.
inline Calls shrunk(const MakeCallable& make, Calls calls) {
  int left = 200'000;  // tries: a while
  const auto improve = [&](rc::Seq<Calls> candidates) {
    while (const auto candidate = candidates.next()) {
      if (--left < 0) return false;
      if (faultOf(make, *candidate).empty()) continue;
      calls = *candidate;
      return true;
    }
    return false;
  };
  while (improve(rc::shrink::removeChunks(calls)) || improve(rc::shrink::eachElement(calls, simpler))) {
  }
  return calls;
}

/// The sequence as code, and what it breaks.
inline std::string written(const MakeCallable& make, const Calls& calls) {
  std::string text;
  const auto object = make();
  for (const Call& call : calls) {
    const Callable::Method& method = object->methods()[call.method];
    text += fmt::format("  {}(", method.name);
    if (method.hasId) text += fmt::format("{}{}", call.id, method.numbers > 0 ? ", " : "");
    for (std::size_t i = 0; i < method.numbers; ++i) text += fmt::format("{}{}", i ? ", " : "", call.v[i]);
    text += ");\n";
  }
  return text + "  // " + faultOf(make, calls) + "\n";
}

/// Anything: usual values in [-1, 1], and this share of what no caller should pass.
inline double anything(Random& random, double share) {
  using Limits = std::numeric_limits<double>;
  static const double odd[] = {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(),
                               0,                   -0.0,               1,
                               -1,                  Limits::min(),      Limits::denorm_min(),
                               1e-310,              -1e-310,            1e6,
                               Limits::max(),       Limits::lowest()};
  if (random.uniform(0, 1) >= share) return random.uniform(-1, 1);
  const int i = random.integer(0, 25);
  return i < 14 ? odd[i] : random.uniform(-1, 1) * std::pow(10, random.uniform(-30, random.integer(0, 1) ? 6 : 308));
}

/// Calls new objects of a kind `total` times in all; what breaks a promise is shrunk and told, as
/// code. Empty: nothing does.
inline std::string brokenBy(const MakeCallable& make, std::size_t total, unsigned seed) {
  Random random(seed);
  const std::vector<Callable::Method> methods = make()->methods();
  for (std::size_t made = 0; made < total;) {
    static const double shares[] = {0, 0.005, 0.05, 0.5};
    const double share = shares[random.integer(0, 3)];
    Calls calls(static_cast<std::size_t>(random.integer(1, 300)));
    for (Call& call : calls) {
      call.method = static_cast<std::size_t>(random.integer(0, static_cast<int>(methods.size()) - 1));
      call.id = random.uniform(0, 1) < share ? random.integer(-3, 1 << 30) : random.integer(0, 5);
      for (double& v : call.v) v = anything(random, share);
    }
    made += calls.size();
    if (!faultOf(make, calls).empty()) return written(make, shrunk(make, calls));
  }
  return "";
}

}  // namespace depthservo::test
