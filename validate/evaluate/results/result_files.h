#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

/// Where the frames of a result lie: a folder of files that bear the dataset's frame numbers.
namespace terracast::validate {

/// The files of a folder by frame. A file belongs to the frame that the first digits of its name
/// say: `000012.flo`, `000012_10.png`, `000012_000013_flow.npz`, `frame_12.npy` are frame 12.
struct NumberedFiles {
  std::filesystem::path folder;
  std::map<int, std::string> by_frame;  ///< names
  std::vector<std::string> notes;       ///< files that belong to no frame of the dataset

  bool has(int frame) const { return by_frame.contains(frame); }
  std::filesystem::path path(int frame) const { return folder / by_frame.at(frame); }
};

/// extensions  that count, as ".flo"; names that end in one of `ignored` do not
/// throws      Input: two files of one frame; none of any frame
NumberedFiles find_numbered_files(const std::filesystem::path& folder, int num_frames,
                                  const std::vector<std::string>& extensions,
                                  const std::vector<std::string>& ignored = {});

}  // namespace terracast::validate
