#include "capture/channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "capture/frame_writer.h"
#include "core/image_io.h"
#include "tests/support/tiny_capture.h"

namespace terracast::capture {
namespace {

CameraFrame small_frame() {
  test::TinyCaptureOptions options{.num_frames = 2, .has_tartan2 = false};
  return test::tiny_frame(options, test::tiny_sequence(options), 0, 0);
}

TEST(Channels, TableNamesWhatIsInTheFile) {
  CameraFrame frame = small_frame();
  frame.bottom_range_m = frame.range_m;
  const std::vector<core::ExrImage> parts = core::decode_exr(encode_facts(frame), "facts");
  ASSERT_EQ(parts.size(), 1U);
  std::set<std::string> stored, listed;
  for (const auto& [name, image] : parts[0].float_channels) stored.insert(name);
  for (const auto& [name, image] : parts[0].uint_channels) stored.insert(name);
  for (const ChannelInfo& channel : channels()) {
    listed.insert(std::string(channel.name));
    EXPECT_EQ(parts[0].uint_channels.count(std::string(channel.name)),
              channel.type == "uint" ? 1U : 0U)
        << channel.name;
  }
  EXPECT_EQ(stored, listed);
}

TEST(Channels, ThoseThatNobodyAskedForAreNotStored) {
  const std::vector<core::ExrImage> parts = core::decode_exr(encode_facts(small_frame()), "facts");
  ASSERT_EQ(parts.size(), 1U);
  for (const ChannelInfo& channel : channels()) {
    const std::string name(channel.name);
    EXPECT_EQ(parts[0].float_channels.count(name) + parts[0].uint_channels.count(name),
              channel.is_optional ? 0U : 1U)
        << name;
  }
}

// "range_m", not "Z": viewers and compositors take a channel Z for planar depth, and R, G, B for
// colour.
TEST(Channels, NoNameThatToolsTakeForSomethingElse) {
  for (const ChannelInfo& channel : channels())
    for (const char* taken : {"R", "G", "B", "A", "Y", "Z", "N.x", "depth"})
      EXPECT_NE(channel.name, taken);
}

TEST(Channels, ARangeAndAClassAgree) {
  const auto number = [](SemanticClass semantic) { return static_cast<std::uint32_t>(semantic); };
  EXPECT_TRUE(agree(kSkyRange_m, number(SemanticClass::Sky)));
  EXPECT_TRUE(agree(kNoRange_m, number(SemanticClass::Nothing)));
  EXPECT_TRUE(agree(12.0F, number(SemanticClass::Grass)));
  EXPECT_FALSE(agree(12.0F, number(SemanticClass::Sky)));
  EXPECT_FALSE(agree(12.0F, number(SemanticClass::Nothing)));
  EXPECT_FALSE(agree(kNoRange_m, number(SemanticClass::Sky)));
  EXPECT_FALSE(agree(kNoRange_m, number(SemanticClass::Grass)));
  EXPECT_FALSE(agree(kSkyRange_m, number(SemanticClass::Grass)));
  EXPECT_FALSE(agree(-1.0F, number(SemanticClass::Grass)));
  EXPECT_FALSE(agree(12.0F, static_cast<std::uint32_t>(semantic_class_names().size())));
}

TEST(Channels, EveryClassHasAName) {
  const auto name_of = [](SemanticClass semantic) {
    return semantic_class_names()[static_cast<std::size_t>(semantic)];
  };
  EXPECT_EQ(semantic_class_names().size(), static_cast<std::size_t>(SemanticClass::Train) + 1);
  EXPECT_EQ(name_of(SemanticClass::Sand), "sand");
  EXPECT_EQ(name_of(SemanticClass::Road), "road");
  EXPECT_EQ(name_of(SemanticClass::Tree), "tree");
  EXPECT_EQ(name_of(SemanticClass::Ship), "ship");
  EXPECT_EQ(name_of(SemanticClass::Cloud), "cloud");
}

TEST(Channels, FlagsOfCamerasDoNotMeetTheOthers) {
  std::uint32_t seen = kEdge | kVisibleNext | kVisiblePrevious;
  for (int k = 0; k < kMaxCameras; ++k) {
    EXPECT_EQ(seen & visible_in_camera(k), 0U) << k;
    seen |= visible_in_camera(k);
  }
}

}  // namespace
}  // namespace terracast::capture
