#include "experiments/sweepKeys.h"

#include "scenario/keyTables.h"
#include "text/KeyTree.h"

namespace depthservo {

using detail::Fields;
using detail::kRequired;
using detail::Range;

namespace {

constexpr Range kAnyValue{-1e12, 1e12};

void describe(Fields& f, SweepCone& cone) {
  f.number({"angle", "half the angle of the cone around the front of the target", kRequired},
           cone.angle, Range::above(0, 1.5), "rad");
  f.numbers({"distance", "least and greatest, of the camera from the middle of the target; on the "
                         "floor, for robots that stand on it",
             kRequired},
            cone.distance, Range::above(0, 1000), "m");
  f.number({"aim", "the optical axis is off the middle of the target by up to it"}, cone.aim,
           {0, 1.5}, "rad");
  f.number({"roll", "the camera is turned about its optical axis by up to it (robot free)"},
           cone.roll, {0, 3.2}, "rad");
  f.number({"margin", "the points are so far from the border of the image, at least"}, cone.margin,
           {0, 10000}, "px");
}

void describe(Fields& f, SweepAxis& axis) {
  f.text({"name", "of its column in the results", kRequired}, axis.name);
  f.text({"key",
          "of the scenario; or start.distance, start.bearing, start.elevation, start.aim, "
          "start.roll: where the robot starts, seen from the target (doc/sweeps.md)"},
         axis.key);
  f.texts({"values", "of that key, one after the other"}, axis.values);
  f.number({"from", "instead: the first value"}, axis.from, kAnyValue, "");
  f.number({"to", "the last value"}, axis.to, kAnyValue, "");
  f.integer({"count", "so many values from the one to the other, or so many drawn"}, axis.count,
            {0, 100000}, "");
  f.flag({"log", "equal factors lie between them, not equal differences"}, axis.isLog);
  f.choice<SweepDraw>({"draw", "values at random, by the seed of the sweep and the name of the axis"},
                      axis.draw,
                      {{SweepDraw::none, "none"},
                       {SweepDraw::uniform, "uniform"},
                       {SweepDraw::normal, "normal"}});
  f.number({"mean", "of `draw: normal`"}, axis.mean, kAnyValue, "");
  f.number({"sigma", "of `draw: normal`"}, axis.sigma, Range::above(0, 1e12), "");
  f.list({"cases", "instead of all that: values that set several keys at once"}, axis.cases,
         [](Fields& fields, SweepCase& one) {
           fields.text({"name", "in the column", kRequired}, one.name);
           fields.texts({"set", "key=value of each key, as for --set"}, one.set);
         });
  f.section({"cone", "instead: `count` start poses that see the target, drawn as above"}, axis.cone,
            [](Fields& fields, SweepCone& cone) { describe(fields, cone); });
}

void describe(Fields& f, SweepClaim& claim) {
  f.text({"id", "its name", kRequired}, claim.id);
  f.text({"claim", "what the figure says", kRequired}, claim.claim);
  f.texts({"where", "of the runs with these column=value; empty: of all"}, claim.where);
  f.choice<SweepFigure>({"of", "share or count of success, or a statistic of `metric`"}, claim.of,
                        figureWords());
  f.text({"metric", "one of `metrics`"}, claim.metric);
  f.number({"expected", "the figure", kRequired}, claim.expected, kAnyValue, "");
  f.text({"within", "'2 %', '0.1', 'factor 1.5' or 'at most 3' of it"}, claim.within);
  f.text({"unit", "of the figure"}, claim.unit);
  f.text({"note", "what else is to be said"}, claim.note);
}

void describePages(Fields& f, SweepOptions& sweep) {
  f.list({"maps", "pictures of the outcomes over two columns; default: of the first two"},
         sweep.maps, [](Fields& fields, SweepMap& map) {
           fields.text({"x", "column", kRequired}, map.x);
           fields.text({"y", "column", kRequired}, map.y);
           fields.text({"by", "column: a map for each of its values"}, map.by);
         });
  f.list({"curves", "share of success over a column; default: over every column of numbers"},
         sweep.curves, [](Fields& fields, SweepCurve& curve) {
           fields.text({"x", "column", kRequired}, curve.x);
           fields.text({"by", "column: a curve for each of its values"}, curve.by);
         });
  f.integer({"worst", "so many of the worst runs are repeated with their reports"}, sweep.worst,
            {0, 100}, "");
  f.list({"claims", "figures and what they must be; exit code 0 or 1"}, sweep.claims,
         [](Fields& fields, SweepClaim& claim) { describe(fields, claim); });
}

}  // namespace

const std::vector<detail::Choice<SweepFigure>>& figureWords() {
  static const std::vector<detail::Choice<SweepFigure>> all = {
      {SweepFigure::share, "share"}, {SweepFigure::count, "count"}, {SweepFigure::median, "median"},
      {SweepFigure::mean, "mean"},   {SweepFigure::min, "min"},     {SweepFigure::max, "max"}};
  return all;
}

void describe(Fields& f, SweepOptions& sweep) {
  f.text({"name", "name in the report", kRequired}, sweep.name);
  f.text({"title", "what it asks; a sentence"}, sweep.title);
  f.text({"scenario", "file, from the folder of the sweep, or name of a shipped scenario",
          kRequired},
         sweep.scenario);
  f.texts({"set", "key=value of each key that every run has, as for --set"}, sweep.set);
  f.list({"axes", "what is varied: all combinations are run", kRequired}, sweep.axes,
         [](Fields& fields, SweepAxis& axis) { describe(fields, axis); });
  f.integer({"repeat", "every combination so many times, each with a seed of its own"},
            sweep.repeat, {1, 1000000}, "");
  f.integer({"seed", "of all that is drawn"}, sweep.seed, {0, 4294967295.0}, "");
  f.texts({"seeded_by",
           "axes that, with the repetition, make the seed of a run; runs that differ in others only "
           "have the same noise; empty: all axes"},
          sweep.seededBy);
  f.texts({"metrics", "what is kept of a run beside its outcome (doc/sweeps.md)"}, sweep.metrics);
  f.texts({"success", "outcomes that count as success"}, sweep.success);
  describePages(f, sweep);
}

namespace {

std::vector<detail::KeyNode> sweepKeys() {
  SweepOptions sweep;
  return detail::allKeys([&](Fields& fields) { describe(fields, sweep); });
}

}  // namespace

std::string sweepKeysAsText(const std::string& prefix) {
  return detail::keysAsText(sweepKeys(), prefix);
}

std::string sweepKeysAsMarkdown() { return detail::keysAsMarkdown(sweepKeys()); }

std::string sweepSchema() { return detail::schemaText(sweepKeys(), "depthservo sweep"); }

}  // namespace depthservo
