#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"
#include "core/toml_reader.h"

namespace terracast::batch {

/// Config `[[sweep.list]]`: keys that vary together, row by row.
struct SweepList {
  std::vector<std::string> keys;
  std::vector<core::AnyValue> rows;  ///< each a list of as many values as keys
  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// Config `[[sweep.product]]`: a key that takes each value with each of the other products' values
/// and the lists' rows.
struct SweepProduct {
  std::string key;
  std::vector<core::AnyValue> values;
  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// Config `[[sweep.draw]]`: a key whose value is drawn for each run.
struct SweepDraw {
  std::string key;
  std::vector<double> between;  ///< lowest and highest; or empty
  std::string spread = "even";  ///< of between: even, log
  bool whole = false;           ///< of between: whole numbers, both ends included
  std::vector<core::AnyValue> among;
  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// Config `[sweep]`: the runs that a dataset is made of.
struct SweepOptions {
  std::int64_t seed = 1;
  std::int64_t repeat = 1;
  std::vector<SweepList> lists;
  std::vector<SweepProduct> products;
  std::vector<SweepDraw> draws;
  std::vector<std::string> leave_out;  ///< names of runs that are not to be made
  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// What a run changes in the config.
struct RunChanges {
  /// Names the combination of rows, values and repetition; it stays when others are added, and the
  /// draws follow it.
  std::string identity;
  std::vector<core::TomlDocument::Change> changes;
  /// "conditions.sun_elevation_deg = 20.0, world.seed = 7".
  std::string text() const;
};

/// The runs of a dataset description: every combination of the lists' rows and the products' values,
/// `repeat` times. The first list varies slowest, the repetition fastest, so that runs of one world
/// stand together where the world is swept first.
/// threads   safe
class Sweep {
 public:
  /// throws Config: more than 10 million runs; two entries sweep one key
  explicit Sweep(SweepOptions options);

  std::int64_t num_runs() const { return num_runs_; }
  RunChanges run(std::int64_t index) const;
  const SweepOptions& options() const { return options_; }

 private:
  SweepOptions options_;
  std::int64_t num_runs_ = 1;
};

}  // namespace terracast::batch
