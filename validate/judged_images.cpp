#include "validate/judged_images.h"

namespace terracast::validate {

std::vector<std::string> JudgedImages::unseen_parts(const Sequence& sequence,
                                                    std::string FrameFiles::*file) const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < sequence.cameras.size(); ++i) {
    const Camera& camera = sequence.cameras[i];
    for (std::size_t frame = 0; frame < camera.files.size(); ++frame) {
      if ((camera.files[frame].*file).empty() ||
          images_.contains({static_cast<int>(i), static_cast<int>(frame)}))
        continue;
      names.push_back(camera.name);
      break;
    }
  }
  return names;
}

}  // namespace terracast::validate
