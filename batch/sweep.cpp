#include "batch/sweep.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/config_tree.h"
#include "core/hash.h"
#include "core/random.h"

namespace terracast::batch {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::int64_t kMaxRuns = 10'000'000;

const core::ConfigList& items_of(const core::AnyValue& row) {
  return std::get<core::ConfigList>(row.node->data);
}

core::AnyValue value_of(const core::ConfigNode& node) {
  return {std::make_shared<const core::ConfigNode>(node)};
}

/// A text's hash as the 64 bits that the random streams take.
std::uint64_t bits_of(const std::string& text) {
  return std::stoull(core::content_hash(text).substr(0, 16), nullptr, 16);
}

core::AnyValue drawn(const SweepDraw& draw, double share) {
  if (!draw.among.empty()) {
    const auto count = static_cast<double>(draw.among.size());
    return draw.among[static_cast<std::size_t>(std::min(share * count, count - 1.0))];
  }
  const double low = draw.between[0];
  const double high = draw.between[1];
  core::ConfigNode node;
  node.place.source = std::make_shared<const core::ConfigSource>(
      core::ConfigSource{"the sweep's draw of " + draw.key, {}, {}, nullptr});
  if (draw.whole) {
    node.data =
        static_cast<std::int64_t>(std::min(low + std::floor(share * (high - low + 1.0)), high));
  } else if (draw.spread == "log") {
    // The last bits of pow differ between processors, and every one is to draw the same.
    node.data = std::stod(fmt::format("{:.9g}", low * std::pow(high / low, share)));
  } else {
    node.data = low + share * (high - low);
  }
  return value_of(node);
}

}  // namespace

void SweepList::describe(core::SchemaVisitor& visit) {
  visit.key("keys", keys, "Keys that vary together.", core::required({.min_size = 1}));
  visit.key("rows", rows, "A list of values for each row, one for each key.",
            core::required({.min_size = 1}));
}

void SweepList::validate() const {
  for (const core::AnyValue& row : rows) {
    const auto* items = std::get_if<core::ConfigList>(&row.node->data);
    if (items == nullptr || items->size() != keys.size())
      core::fail_at(row.node->place, "{}: a row is a list of {} values, one for each of {}",
                    row.toml(), keys.size(), fmt::join(keys, ", "));
  }
}

void SweepProduct::describe(core::SchemaVisitor& visit) {
  visit.key("key", key, "The key.", core::required());
  visit.key("values", values, "Its values.", core::required({.min_size = 1}));
}

void SweepProduct::validate() const {
  if (key.empty()) fail(ErrorKind::Config, "key is empty; name the key that takes the values");
}

void SweepDraw::describe(core::SchemaVisitor& visit) {
  visit.key("key", key, "The key.", core::required());
  visit.key("between", between, "Lowest and highest value; or left out, with `among`.",
            core::size_of(2));
  visit.key("spread", spread, "How values between are spread: evenly, or their logarithms evenly.",
            core::one_of({"even", "log"}));
  visit.key("whole", whole, "Whole numbers only, both ends included.");
  visit.key("among", among, "The values to draw from; or left out, with `between`.");
}

void SweepDraw::validate() const {
  if (key.empty()) fail(ErrorKind::Config, "key is empty; name the key that is drawn");
  if (between.empty() == among.empty())
    fail(ErrorKind::Config, "the draw of {} takes either between = [LOW, HIGH] or among = […]",
         key);
  if (between.empty()) {
    if (whole || spread != "even")
      fail(ErrorKind::Config, "the draw of {}: whole and spread belong to between", key);
    return;
  }
  if (!(between[0] <= between[1]))
    fail(ErrorKind::Config, "the draw of {}: between = [{}, {}]; the lower value comes first", key,
         between[0], between[1]);
  if (spread == "log" && (whole || between[0] <= 0.0))
    fail(ErrorKind::Config,
         "the draw of {}: spread = \"log\" takes values above 0 that are not whole numbers", key);
  if (whole && (between[0] != std::floor(between[0]) || between[1] != std::floor(between[1]) ||
                std::max(std::abs(between[0]), std::abs(between[1])) > 9e15))
    fail(ErrorKind::Config, "the draw of {}: whole numbers lie between whole numbers up to 9e15",
         key);
}

void SweepOptions::describe(core::SchemaVisitor& visit) {
  visit.key("seed", seed, "Seed of what is drawn.");
  visit.key("repeat", repeat,
            "Runs of each combination; what is drawn differs from one to another.",
            core::between(1, static_cast<double>(kMaxRuns)));
  visit.key("leave_out", leave_out,
            "Runs that are not made, by the names that `terracast batch status` gives them: those "
            "that cannot be made and keep the rest from being merged.");
  visit.list("list", lists, "Keys that vary together.");
  visit.list("product", products, "Keys of which every combination of values is made.");
  visit.list("draw", draws, "Keys whose value is drawn for each run.");
}

void SweepOptions::validate() const {
  std::set<std::string> keys;
  const auto add = [&](const std::string& key) {
    if (!keys.insert(key).second)
      fail(ErrorKind::Config, "{} is swept twice; a key takes one list, product or draw", key);
  };
  for (const SweepList& list : lists)
    for (const std::string& key : list.keys) add(key);
  for (const SweepProduct& product : products) add(product.key);
  for (const SweepDraw& draw : draws) add(draw.key);
}

std::string RunChanges::text() const {
  std::string text;
  for (const auto& change : changes)
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", change.key, change.value.toml());
  return text;
}

Sweep::Sweep(SweepOptions options) : options_(std::move(options)) {
  const auto multiply = [&](std::size_t count) {
    if (static_cast<std::int64_t>(count) > kMaxRuns / num_runs_)
      fail(ErrorKind::Config, "the sweep makes more than {} runs; cut it into several batches",
           kMaxRuns);
    num_runs_ *= static_cast<std::int64_t>(count);
  };
  for (const SweepList& list : options_.lists) multiply(list.rows.size());
  for (const SweepProduct& product : options_.products) multiply(product.values.size());
  multiply(static_cast<std::size_t>(options_.repeat));
}

RunChanges Sweep::run(std::int64_t index) const {
  TERRACAST_CHECK(index >= 0 && index < num_runs_, "run {} of {}", index, num_runs_);
  std::int64_t left = num_runs_;
  const auto digit = [&](std::size_t count) {
    left /= static_cast<std::int64_t>(count);
    return static_cast<std::size_t>(index / left % static_cast<std::int64_t>(count));
  };
  RunChanges run;
  for (const SweepList& list : options_.lists) {
    const core::ConfigList& items = items_of(list.rows[digit(list.rows.size())]);
    for (std::size_t k = 0; k < list.keys.size(); ++k)
      run.changes.push_back({list.keys[k], value_of(items[k])});
  }
  for (const SweepProduct& product : options_.products)
    run.changes.push_back({product.key, product.values[digit(product.values.size())]});
  const std::size_t repetition = digit(static_cast<std::size_t>(options_.repeat));
  run.identity = core::content_hash(fmt::format("{}\nrepetition {}\n", run.text(), repetition));
  for (const SweepDraw& draw : options_.draws) {
    const double share = core::random_unit(static_cast<std::uint64_t>(options_.seed),
                                           bits_of(draw.key), bits_of(run.identity));
    run.changes.push_back({draw.key, drawn(draw, share)});
  }
  return run;
}

}  // namespace terracast::batch
