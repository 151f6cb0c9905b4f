#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/e2e/settled_job.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "validate/dataset.h"

/// A town by the sea with every layer, flown over and dived beside: every check of every format holds, and each
/// corruption of what its objects look like is found by the check that is for it.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;

/// Checks of a report.json by name, of those that do not hold.
std::map<std::string, std::string> failures_of(const fs::path& report) {
  std::map<std::string, std::string> failures;
  const Json json = Json::read(report / "report.json");
  for (std::size_t i = 0; i < json.at("checks").size(); ++i) {
    const Json& check = json.at("checks").at(i);
    if (!check.at("ok").boolean())
      failures[check.at("name").string()] =
          fmt::format("{} {}, {}", check.at("value").number(), check.at("unit").string(),
                      check.at("worst").string());
  }
  return failures;
}

std::string text_of(const std::map<std::string, std::string>& failures) {
  std::string text;
  for (const auto& [name, words] : failures) text += name + ": " + words + "\n";
  return text;
}

/// Names of the classes that a dataset's labels show.
std::set<std::string> classes_shown(const fs::path& folder) {
  validate::Findings findings;
  const validate::Dataset dataset = validate::read_dataset(folder, "", findings);
  const validate::Reader& reader = validate::find_reader(dataset.format);
  std::set<std::string> shown;
  for (const validate::Sequence& sequence : dataset.sequences)
    for (const validate::Camera& camera : sequence.cameras)
      for (int frame = 0; frame < sequence.num_frames; ++frame) {
        const core::Image8 classes = reader.segmentation(dataset, camera, frame);
        for (const std::uint8_t value : classes.data()) shown.insert(sequence.classes.at(value));
      }
  return shown;
}

/// Changes values of one image's files where it shows a class.
class Pixels {
 public:
  Pixels(const fs::path& folder, const std::string& sequence, int frame) : folder_(folder) {
    validate::Findings findings;
    dataset_ = validate::read_dataset(folder, "", findings);
    for (const validate::Sequence& one : dataset_.sequences)
      if (one.name == sequence) sequence_ = &one;
    if (sequence_ == nullptr) throw std::logic_error("no sequence " + sequence);
    files_ = sequence_->cameras.at(0).files.at(static_cast<std::size_t>(frame));
    classes_ =
        validate::find_reader(dataset_.format).segmentation(dataset_, sequence_->cameras[0], frame);
  }
  std::uint8_t value_of(const std::string& name) const {
    for (const auto& [value, known] : sequence_->classes)
      if (known == name) return static_cast<std::uint8_t>(value);
    ADD_FAILURE() << name << " is no class of the dataset";
    return 0;
  }
  void set_class(const std::string& from, const std::string& to) {
    change<std::uint8_t>(files_.segmentation, from,
                         [value = value_of(to)](std::uint8_t) { return value; });
  }
  void scale_depth(const std::string& of, float factor) {
    change<float>(files_.depth, of, [factor](float depth) { return depth * factor; });
  }
  void invert_mask(const std::string& of) {
    change<std::uint8_t>(files_.flow + "_mask.npy", of, [](std::uint8_t value) -> std::uint8_t {
      return value < 2 ? 1 - value : value;
    });
  }

 private:
  template <class Value, class Change>
  void change(const std::string& path, const std::string& of, const Change& to) {
    std::vector<std::byte> bytes = core::read_file(folder_ / path);
    const std::size_t header = 10U + std::to_integer<std::size_t>(bytes.at(8)) +
                               256U * std::to_integer<std::size_t>(bytes.at(9));
    ASSERT_EQ(bytes.size(), header + sizeof(Value) * classes_.data().size()) << path;
    const std::uint8_t wanted = value_of(of);
    int num_changed = 0;
    for (std::size_t i = 0; i < classes_.data().size(); ++i) {
      if (classes_.data()[i] != wanted) continue;
      Value value;
      std::memcpy(&value, &bytes[header + i * sizeof(Value)], sizeof(Value));
      value = to(value);
      std::memcpy(&bytes[header + i * sizeof(Value)], &value, sizeof(Value));
      ++num_changed;
    }
    EXPECT_GT(num_changed, 500) << "pixels of class " << of;
    core::write_file(folder_ / path, bytes);
  }

  fs::path folder_;
  validate::Dataset dataset_;
  const validate::Sequence* sequence_ = nullptr;
  validate::FrameFiles files_;
  core::Image8 classes_;
};

struct Corruption {
  const char* name;
  const char* sequence;
  std::function<void(Pixels&)> corrupt;
  const char* check;  ///< that must fail
};

TEST(SettledFlight, PassesEveryCheckAboveAndBelowTheWaterAndEachCorruptionIsFound) {
  const ScratchFolder scratch;
  const fs::path config = write_settled_job(scratch / "job");
  const fs::path out = scratch / "out";
  const auto made = run_program({"run", config.string(), "--out", out.string(), "-q"});
  ASSERT_EQ(made.status, 0) << made.output << text_of(failures_of(out / "report"));
  const fs::path dataset = out / "export/tartanair_v1";
  const std::set<std::string> shown = classes_shown(dataset);
  for (const char* name :
       {"building", "tree", "road", "boat", "pier", "pylon", "power_line", "seabed"})
    EXPECT_TRUE(shown.contains(name)) << name << " is not shown";

  const std::vector<Corruption> corruptions = {
      {"buildings called cars", "P000", [](Pixels& pixels) { pixels.set_class("building", "car"); },
       "oracle_class"},
      {"buildings called trees, which they are not in the other image", "P000",
       [](Pixels& pixels) { pixels.set_class("building", "tree"); }, "segmentation"},
      {"a tenth of a per mille nearer", "P000",
       [](Pixels& pixels) { pixels.scale_depth("building", 0.9999F); }, "oracle_depth"},
      {"trees 5 % nearer than flow knows", "P000",
       [](Pixels& pixels) { pixels.scale_depth("tree", 0.95F); }, "flow"},
      // Of a building little is hidden: some twenty pixels, which are among those of the oracle by chance alone.
      {"what is hidden called seen on buildings", "P000",
       [](Pixels& pixels) { pixels.invert_mask("building"); }, "flow_masks"},
      {"the sea's bed called its surface", "P001",
       [](Pixels& pixels) { pixels.set_class("seabed", "sea"); }, "oracle_class"},
      {"the bed a per mille deeper", "P001",
       [](Pixels& pixels) { pixels.scale_depth("seabed", 1.001F); }, "oracle_depth"},
  };
  for (const Corruption& corruption : corruptions) {
    SCOPED_TRACE(corruption.name);
    const fs::path folder = scratch / "data";
    fs::remove_all(folder);
    fs::copy(dataset, folder, fs::copy_options::recursive);
    Pixels pixels(folder, corruption.sequence, 0);
    corruption.corrupt(pixels);
    const auto run = run_program({"validate", folder.string(), "--world", (out / "world").string(),
                                  "--report", (scratch / "report").string(), "-q"});
    EXPECT_EQ(run.status, 1) << run.output;
    const auto failures = failures_of(scratch / "report");
    EXPECT_TRUE(failures.contains(corruption.check)) << text_of(failures);
  }
}

}  // namespace
}  // namespace terracast::test
