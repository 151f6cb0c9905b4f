#include <gtest/gtest.h>

#include <vector>

#include "tests/jobs/draws.h"
#include "validate/checks/photometric_frames.h"

/// One image that is shifted, or is another one, among images of a camera that are as they should be. What patches say is
/// drawn: shifts scatter evenly by half a pixel, and patches of other ground correlate by 0.3 at most.
namespace terracast::validate {
namespace {

constexpr int kNumFrames = 9;

/// A camera of 640 x 480 px, each of whose images shares patches with the two after it.
struct DrawnCamera {
  std::string name = "left";
  int num_patches = 300;  ///< of each pair
  int wrong_frame = -1;
  double shift_px = 0.0;    ///< of the wrong frame
  bool is_foreign = false;  ///< of the wrong frame
};

std::vector<CheckResult> results_of(const std::vector<DrawnCamera>& cameras, std::uint64_t seed) {
  Sequence sequence;
  sequence.num_frames = kNumFrames;
  for (const DrawnCamera& drawn : cameras) {
    Camera& camera = sequence.cameras.emplace_back();
    camera.name = drawn.name;
    camera.intrinsics.width_px = 640;
    camera.intrinsics.height_px = 480;
    camera.files.resize(kNumFrames);
    for (FrameFiles& files : camera.files) files.color = "image.png";
  }
  SingleImages images(false);
  for (int frame = 0; frame < kNumFrames; ++frame) {
    for (std::size_t i = 0; i < cameras.size(); ++i)
      for (const int next : {frame + 1, frame + 2}) {
        if (next >= kNumFrames) continue;
        const DrawnCamera& drawn = cameras[i];
        test::Draws draws(seed * 1000 + static_cast<std::uint64_t>(next),
                          drawn.name + std::to_string(frame));
        const auto is_wrong = [&](int at) { return at == drawn.wrong_frame ? 1.0 : 0.0; };
        PairMatches matches;
        for (int k = 0; k < drawn.num_patches; ++k) {
          // Along rows alone: what the first image shows too far to the right the second one shows to its left.
          matches.shift_x.push_back(drawn.shift_px * (is_wrong(frame) - is_wrong(next)) +
                                    draws.both_ways(0.5));
          matches.shift_y.push_back(draws.both_ways(0.5));
          const bool is_other = drawn.is_foreign && is_wrong(frame) + is_wrong(next) > 0.0;
          matches.correlation.push_back(is_other ? draws.both_ways(0.3) : draws.between(0.5, 1.0));
          matches.own.push_back(draws.between(0.4, 0.8));
        }
        const auto view_of = [&](int at) {
          View view;
          view.camera_index = static_cast<int>(i);
          view.frame = at;
          view.camera = &sequence.cameras[i];
          view.sequence = &sequence;
          return view;
        };
        images.add({view_of(frame), view_of(next)}, matches);
      }
    images.finish_before(frame - 2);
  }
  return images.results(sequence);
}

TEST(SingleImages, OfRightDatasetsAreNeitherShiftedNorOthers) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const int num_patches = 5 + static_cast<int>(seed % 7) * 40;
    for (const CheckResult& result : results_of({{.num_patches = num_patches}}, seed))
      EXPECT_TRUE(result.ok) << seed << ": " << result.name << " " << result.worst;
  }
}

TEST(SingleImages, AShiftOfTheSizeThatIsSaidIsFoundWhereItIs) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const CheckResult right = results_of({{}}, seed).at(1);
    ASSERT_TRUE(right.smallest.has_value());
    // Medians of 300 patches and more, a quarter of which lie within 0.13 px of the middle.
    EXPECT_LT(*right.smallest, 1.0);
    const int wrong = static_cast<int>(seed % kNumFrames);
    const CheckResult found =
        results_of({{.wrong_frame = wrong, .shift_px = *right.smallest}}, seed).at(1);
    EXPECT_EQ(found.name, "photometric_frame_shift");
    EXPECT_FALSE(found.ok) << seed;
    EXPECT_EQ(found.worst, "left, frame " + std::to_string(wrong));
    EXPECT_TRUE(results_of({{.wrong_frame = wrong, .shift_px = 0.2}}, seed).at(1).ok) << seed;
  }
}

TEST(SingleImages, AnotherOneIsFoundAndCamerasOfTooFewPatchesAreNamed) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const int wrong = static_cast<int>(seed % kNumFrames);
    const CheckResult found = results_of({{.wrong_frame = wrong, .is_foreign = true}}, seed).at(0);
    EXPECT_FALSE(found.ok) << seed;
    EXPECT_EQ(found.worst.substr(0, found.worst.find(':')), "left, frame " + std::to_string(wrong));
  }
  // Of four patches a pair nothing follows, whether the image is another one or not.
  for (const bool is_foreign : {false, true}) {
    const CheckResult result = results_of({{}, {"right", 4, 3, 0.0, is_foreign}}, 7).at(0);
    EXPECT_TRUE(result.ok);
    EXPECT_EQ(result.unseen_parts, std::vector<std::string>{"right"});
  }
  EXPECT_TRUE(results_of({{}}, 7).at(0).unseen_parts.empty());
}

}  // namespace
}  // namespace terracast::validate
