#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/support/record.h"
#include "tests/support/test_data.h"
#include "tests/validate/mutations/mutations.h"
#include "validate/check.h"
#include "validate/dataset.h"

/// Every corruption of the catalogue is found and named in every format that can hold it, on a
/// curved flight and on a level straight one at constant speed; right datasets name nothing.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

/// Right datasets, written once for all tests of the process.
class RightDatasets {
 public:
  RightDatasets() {
    root_ = fs::temp_directory_path() / ("terracast-mutations-" + std::to_string(::getpid()));
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~RightDatasets() {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }
  RightDatasets(const RightDatasets&) = delete;
  RightDatasets& operator=(const RightDatasets&) = delete;

  const test::RightDataset& get(const std::string& format, test::Path path) {
    const std::string name = format + (path == test::Path::Curved ? "_curved" : "_straight");
    auto found = datasets_.find(name);
    if (found == datasets_.end())
      found = datasets_.emplace(name, test::write_right_dataset(format, path, root_ / name)).first;
    return found->second;
  }
  fs::path scratch() const { return root_; }

 private:
  fs::path root_;
  std::map<std::string, test::RightDataset> datasets_;
};
RightDatasets& right_datasets() {
  static RightDatasets datasets;
  return datasets;
}

struct Report {
  bool is_ok = false;
  std::string wrong;  ///< failed checks, a line each
  core::Json causes;
};

Report validate_folder(const fs::path& folder) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.undulation_m = [](double, double) { return test::kUndulation_m; };
  const fs::path report = right_datasets().scratch() / "report";
  Report result;
  result.is_ok = true;
  for (const CheckResult& check : run_validate_stage(folder, options, report, {log})) {
    result.is_ok = result.is_ok && check.ok;
    if (!check.ok)
      result.wrong += fmt::format("{} = {:.4g} {} (bound {:.4g}): {}\n", check.name, check.value,
                                  check.unit, check.bound, check.worst.substr(0, 200));
  }
  result.causes = core::Json::read(report / "report.json").at("causes");
  return result;
}

std::string words_of(const core::Json& causes) {
  std::string text;
  for (std::size_t i = 0; i < causes.size(); ++i)
    text += fmt::format("  {} [{}] {}\n", causes.at(i).at("words").string(),
                        causes.at(i).at("size").number(),
                        fmt::join(causes.at(i).at("checks").strings(), ", "));
  return text.empty() ? "  nothing\n" : text;
}

bool is_named(const core::Json& causes, const test::Expected& expected) {
  for (std::size_t i = 0; i < causes.size(); ++i) {
    const std::string& words = causes.at(i).at("words").string();
    const bool has_all =
        std::all_of(expected.words.begin(), expected.words.end(),
                    [&](const std::string& part) { return words.find(part) != std::string::npos; });
    if (has_all && (!expected.size || std::abs(causes.at(i).at("size").number() - *expected.size) <=
                                          expected.tolerance))
      return true;
  }
  return false;
}

/// The formats of flights. terracast's own, which takes every camera, is corrupted in tests/e2e/every_camera_test.cpp,
/// EuRoC's and MCAP, which hold sensors, and TUM's in tests/e2e/euroc_flight_test.cpp and tests/e2e/mcap_flight_test.cpp.
/// In those of single images, which have neither poses nor depth, mistakes are findings of their
/// readers: tests/labels/validate_test.cpp.
std::vector<std::string> flight_formats() {
  std::vector<std::string> formats = reader_names();
  std::erase_if(formats, [](const std::string& format) {
    return format == "coco" || format == "euroc" || format == "kitti_object" || format == "mcap" ||
           format == "terracast" || format == "tum";
  });
  return formats;
}

struct Case {
  const test::Mutation* mutation;
  std::string format;
  test::Path path;
};

/// Whether a straight flight hides a mutation that its format holds.
bool is_unseeable(const std::string& mutation, const std::string& format, test::Path path) {
  return path == test::Path::Straight &&
         std::any_of(test::unseeable_mutations().begin(), test::unseeable_mutations().end(),
                     [&](const test::Unseeable& u) {
                       return u.is_of_straight_flight && u.mutation == mutation &&
                              u.format == format;
                     });
}

/// Formats in which an ordinary run tries each mutation that it tries in one alone: by turns.
std::map<std::string, std::string> single_formats() {
  std::map<std::string, std::string> formats;
  for (const test::Mutation& mutation : test::mutations())
    if (mutation.is_in_one_format)
      formats[mutation.name] = mutation.formats[formats.size() % mutation.formats.size()];
  return formats;
}

/// All in recorded runs. Else each mutation on one of a format's two flights, by turns; TartanAir's images are
/// large: of its cases every fifth. Those that are tried in one format are tried there in any case.
std::vector<Case> cases() {
  const bool is_full = test::is_recorded_run();
  const std::map<std::string, std::string> single_format = single_formats();
  constexpr int kEvery = 5;
  int num_of_tartan = 0;
  std::vector<Case> list;
  for (const std::string& format : flight_formats()) {
    bool is_curved_next = true, is_single_curved_next = true;
    for (const test::Mutation& mutation : test::mutations()) {
      if (std::find(mutation.formats.begin(), mutation.formats.end(), format) ==
          mutation.formats.end())
        continue;
      std::vector<test::Path> paths = {test::Path::Curved};
      if (!is_unseeable(mutation.name, format, test::Path::Straight))
        paths.push_back(test::Path::Straight);
      const auto single = single_format.find(mutation.name);
      const bool is_single = !is_full && single != single_format.end();
      if (is_single && single->second != format) continue;
      if (is_single || (!is_full && !format.starts_with("tartanair"))) {
        bool& is_curved = is_single ? is_single_curved_next : is_curved_next;
        if (paths.size() > 1) paths.erase(is_curved ? paths.end() - 1 : paths.begin());
        is_curved = !is_curved;
      }
      for (const test::Path path : paths)
        if (is_full || is_single || !format.starts_with("tartanair") ||
            num_of_tartan++ % kEvery == 0)
          list.push_back({&mutation, format, path});
    }
  }
  return list;
}

std::string name_of(const std::string& format, test::Path path) {
  return format + (path == test::Path::Curved ? "_curved" : "_straight");
}

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.mutation->name << " in " << name_of(one.format, one.path);
}

class Corrupted : public testing::TestWithParam<Case> {
 protected:
  static void TearDownTestSuite() {
    const testing::TestSuite& suite = *testing::UnitTest::GetInstance()->current_test_suite();
    const std::string formats = fmt::format("{}", fmt::join(formats_seen(), ", "));
    test::record(
        "corruptions", formats,
        fmt::format("| {} | {} of {} | {:.0f} s |", formats, suite.successful_test_count(),
                    suite.test_to_run_count(), 1e-3 * static_cast<double>(suite.elapsed_time())));
  }
  static std::set<std::string>& formats_seen() {
    static std::set<std::string> formats;
    return formats;
  }
};

TEST_P(Corrupted, IsFoundAndNamed) {
  formats_seen().insert(GetParam().format);
  const test::RightDataset& right = right_datasets().get(GetParam().format, GetParam().path);
  const test::ScratchFolder scratch;
  test::corrupt(right, *GetParam().mutation, scratch / "data");
  const Report report = validate_folder(scratch / "data");
  EXPECT_FALSE(report.is_ok);
  const test::Expected expected = GetParam().mutation->expected(right);
  EXPECT_TRUE(is_named(report.causes, expected))
      << fmt::format("expected: {}\nnamed:\n{}failed checks:\n{}", fmt::join(expected.words, " … "),
                     words_of(report.causes), report.wrong);
  if (std::getenv("TERRACAST_SHOW_CAUSES") != nullptr)
    std::fputs(words_of(report.causes).c_str(), stdout);
}

INSTANTIATE_TEST_SUITE_P(Catalogue, Corrupted, testing::ValuesIn(cases()), [](const auto& one) {
  return one.param.mutation->name + "_" + name_of(one.param.format, one.param.path);
});

struct RightCase {
  std::string format;
  test::Path path;
};
void PrintTo(const RightCase& one, std::ostream* out) { *out << name_of(one.format, one.path); }

class RightIsland : public testing::TestWithParam<RightCase> {};

TEST_P(RightIsland, PassesAndNamesNothing) {
  const test::RightDataset& right = right_datasets().get(GetParam().format, GetParam().path);
  const Report report = validate_folder(right.folder);
  EXPECT_TRUE(report.is_ok) << report.wrong;
  EXPECT_EQ(report.causes.size(), 0U) << words_of(report.causes);
}

std::vector<RightCase> right_cases() {
  std::vector<RightCase> list;
  for (const std::string& format : flight_formats())
    for (const test::Path path : {test::Path::Curved, test::Path::Straight})
      list.push_back({format, path});
  return list;
}
INSTANTIATE_TEST_SUITE_P(Catalogue, RightIsland, testing::ValuesIn(right_cases()),
                         [](const auto& one) { return name_of(one.param.format, one.param.path); });

TEST(MutationCatalogue, HoldsEachMutationForAFormatOrSaysWhyNot) {
  const std::vector<test::Mutation>& all = test::mutations();
  EXPECT_GE(all.size(), 120U);
  std::set<std::string> names;
  for (const test::Mutation& mutation : all) {
    EXPECT_TRUE(names.insert(mutation.name).second) << mutation.name;
    for (const std::string& format : flight_formats()) {
      const bool is_held = std::find(mutation.formats.begin(), mutation.formats.end(), format) !=
                           mutation.formats.end();
      const bool has_reason =
          std::any_of(test::unseeable_mutations().begin(), test::unseeable_mutations().end(),
                      [&](const test::Unseeable& u) {
                        return u.mutation == mutation.name &&
                               (u.format.empty() || u.format == format) && !u.why.empty();
                      });
      EXPECT_TRUE(is_held || has_reason) << mutation.name << " in " << format;
    }
  }
}

}  // namespace
}  // namespace terracast::validate
