// Every field of every file of every format is proved by some check, or named as not proved.

#include "tests/validate/fields/fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/random.h"
#include "tests/support/record.h"
#include "tests/support/test_data.h"
#include "tests/validate/fields/every_file_job.h"
#include "validate/checks/checker.h"
#include "validate/not_proved.h"

namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using core::Json;
using test::Amount;
using test::Field;
using test::FieldPlace;

ValidateOptions few_samples() {
  ValidateOptions options;
  options.samples_per_image = 200;
  options.oracle_samples = 20;
  options.world = test::every_file_job() / "world";
  return options;
}

enum class Look { AtText, AtImagesToo };

/// Names of the checks that fail. Without images, those of checks that have none of what they compare do not.
std::set<std::string> failed_checks(const fs::path& folder, Look look) {
  const ValidateOptions options = few_samples();
  std::set<std::string> failed;
  Findings findings;
  try {
    const Dataset dataset = read_dataset(folder, "", findings);
    for (const Sequence& sequence : dataset.sequences) {
      if (findings.count() > 0) break;
      std::vector<std::unique_ptr<Checker>> checkers;
      for (const CheckInfo& info : checks()) checkers.push_back(info.make(options));
      FrameWindow window(dataset, sequence, findings);
      while (look == Look::AtImagesToo && window.advance()) {
        const std::vector<ViewPair> pairs = window.pairs();
        for (const auto& checker : checkers) checker->frame(window, pairs);
      }
      for (const auto& checker : checkers)
        for (const CheckResult& result : checker->finish(dataset, sequence))
          if (!result.ok) failed.insert(result.name);
    }
  } catch (const core::Error&) {
    failed.insert("refused");
  }
  if (findings.count() > 0) failed.insert("structure");
  return failed;
}

/// A copy of a right dataset, in which one file at a time is wrong.
class WrongDataset {
 public:
  WrongDataset(const fs::path& right, const fs::path& folder) : folder_(folder) {
    fs::copy(right, folder, fs::copy_options::recursive);
    at_text_ = failed_checks(folder, Look::AtText);
  }

  /// Whether a check finds a change of one value; where the change leaves all as it was, nothing.
  std::optional<bool> finds(const FieldPlace& place, const Amount& amount) {
    const std::string bytes = core::read_text_file(folder_ / place.file);
    const std::string list = core::read_text_file(folder_ / "dataset.json");
    const std::string changed = place.changed(bytes, amount);
    if (changed == bytes) return std::nullopt;
    core::write_file(folder_ / place.file, std::string_view(changed));
    if (place.file != "dataset.json") list_anew(place.file, changed);
    const bool is_found = fails_anew(Look::AtText) || fails_anew(Look::AtImagesToo);
    core::write_file(folder_ / place.file, std::string_view(bytes));
    core::write_file(folder_ / "dataset.json", std::string_view(list));
    return is_found;
  }

 private:
  /// So that no hash tells.
  void list_anew(const std::string& path, const std::string& bytes) const {
    Json dataset = Json::read(folder_ / "dataset.json");
    Json files = dataset.at("files");
    files.set(path, Json::object()
                        .set("bytes", static_cast<std::uint64_t>(bytes.size()))
                        .set("xxh3_128", core::content_hash(std::string_view(bytes))));
    dataset.set("files", std::move(files)).write(folder_ / "dataset.json");
  }
  bool fails_anew(Look look) const {
    const std::set<std::string> failed = failed_checks(folder_, look);
    if (look == Look::AtImagesToo) return !failed.empty();
    return std::any_of(failed.begin(), failed.end(),
                       [&](const std::string& name) { return !at_text_.contains(name); });
  }

  fs::path folder_;
  std::set<std::string> at_text_;  ///< of the right dataset
};

/// A few places of a field, drawn by seed.
std::vector<FieldPlace> drawn_places(const Field& field, std::size_t count, std::uint64_t seed) {
  std::vector<FieldPlace> drawn;
  for (std::size_t i = 0; i < std::min(count, field.places.size()); ++i)
    drawn.push_back(field.places[core::random_bits(seed, 7, i) % field.places.size()]);
  return drawn;
}

/// Fields that an ordinary run looks at: one in so many, drawn by name.
constexpr std::uint64_t kOrdinaryShare = 4;

bool is_of_images(const Field& field) {
  return field.name.starts_with("channel") || field.name.ends_with("channel 0") ||
         field.name == "float";
}

class Fields : public testing::TestWithParam<std::string> {};

TEST_P(Fields, AreProvedOrNamed) {
  // Images of 640 px: each look at them takes seconds.
  if (GetParam().starts_with("tartanair")) {
    TERRACAST_NEEDS_FULL();
  }
  const test::ScratchFolder scratch;
  const fs::path right = test::every_file_job() / "export" / GetParam();
  EXPECT_EQ(failed_checks(right, Look::AtImagesToo), std::set<std::string>());
  Findings findings;
  const std::vector<NotProved> named = not_proved(read_dataset(right, "", findings));
  WrongDataset wrong(right, scratch / "data");
  const bool is_full = test::is_recorded_run();
  std::map<std::string, int> num_missed_of;  // by what is named
  std::vector<std::string> missed;
  std::size_t num_tried = 0, num_fields = 0;
  for (const Field& field : test::fields_of(right)) {
    const std::string words = field.kind + field.name;
    const std::uint64_t seed = core::content_hash64(std::as_bytes(std::span(words)));
    const NotProved* by = named_by(named, field.places[0].file, field.name);
    if (!is_full && (by != nullptr || seed % kOrdinaryShare != 0)) continue;
    ++num_fields;
    bool is_missed = false;
    for (const FieldPlace& place : drawn_places(field, is_full ? 3 : 1, seed))
      for (const bool is_relative : {false, true}) {
        if (!is_full && is_of_images(field) && is_relative != (seed % 8 == 0)) continue;
        const std::optional<bool> is_found = wrong.finds(place, {seed, is_relative});
        num_tried += is_found ? 1 : 0;
        if (is_found.value_or(true)) continue;
        is_missed = true;
        if (by == nullptr)
          missed.push_back(fmt::format("{}: {} ({})", place.file, field.name,
                                       is_relative ? "relative" : "absolute"));
      }
    if (by != nullptr && is_missed) ++num_missed_of[by->files + by->fields];
  }
  EXPECT_TRUE(missed.empty()) << fmt::format("{}", fmt::join(missed, "\n"));
  for (const NotProved& each : named)
    EXPECT_TRUE(!is_full || num_missed_of[each.files + each.fields] > 0)
        << each.files << ", " << each.fields << " is proved, and need not be named";
  std::printf("%s: %zu fields, %zu changes\n", GetParam().c_str(), num_fields, num_tried);
}

TEST(NotProved, NamesFilesThatNoCheckReads) {
  Dataset dataset;
  dataset.format = "kitti";
  for (const char* path :
       {"dataset/sequences/00/calib.txt", "dataset/sequences/00/sonar/000000.bin",
        "dataset/sequences/00/sonar/000001.bin", "notes.xml"})
    dataset.files[path] = {};
  std::map<std::string, std::int64_t> unknown;
  for (const NotProved& one : not_proved(dataset))
    if (one.fields == "*") unknown[one.files] = one.num_files;
  EXPECT_EQ(unknown, (std::map<std::string, std::int64_t>{
                         {"dataset/sequences/00/sonar/*.bin", 2}, {"notes.xml", 1}}));
  for (int i = 0; i < 200; ++i) dataset.files["notes" + std::string(i, 'a')] = {};
  const std::vector<NotProved> many = not_proved(dataset);
  EXPECT_TRUE(std::any_of(many.begin(), many.end(), [](const NotProved& one) {
    return one.files == "and 102 more" && one.num_files == 102;
  }));
  dataset.format = "lab.own";
  ASSERT_EQ(not_proved(dataset).size(), 1U);
  EXPECT_EQ(not_proved(dataset)[0].num_files, 204);
}

INSTANTIATE_TEST_SUITE_P(Formats, Fields, testing::ValuesIn(format_names()),
                         [](const auto& one) { return one.param; });

}  // namespace
}  // namespace terracast::validate
