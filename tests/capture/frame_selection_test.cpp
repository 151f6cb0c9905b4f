#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "capture/frame.h"

namespace terracast::capture {
namespace {

TEST(FrameSelection, HoldsEveryStepFromTheFirstBelowTheEnd) {
  for (const int num_frames : {1, 7, 10}) {
    for (const FrameSelection& selection :
         {FrameSelection{}, FrameSelection{.first = 2, .step = 3}, FrameSelection{.end = 7},
          FrameSelection{.first = 3, .end = 9, .step = 2}, FrameSelection{.first = 4, .end = 4},
          FrameSelection{.first = 12}, FrameSelection{.step = std::numeric_limits<int>::max()}}) {
      std::vector<int> expected;
      for (int frame = 0; frame < num_frames; ++frame)
        if (frame >= selection.first && frame < selection.end &&
            (frame - selection.first) % selection.step == 0)
          expected.push_back(frame);
      EXPECT_EQ(selection.frames_of(num_frames), expected);
    }
  }
}

}  // namespace
}  // namespace terracast::capture
