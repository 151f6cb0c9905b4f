#include "export/coco_masks.h"

namespace terracast::exporters {

std::string text_of_runs(std::span<const std::uint32_t> runs) {
  std::string text;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::int64_t left = runs[i];
    if (i > 2) left -= runs[i - 2];
    for (bool has_more = true; has_more;) {
      auto group = static_cast<int>(left & 0x1f);
      left >>= 5;
      // The group's highest bit is its sign.
      has_more = (group & 0x10) != 0 ? left != -1 : left != 0;
      if (has_more) group |= 0x20;
      text += static_cast<char>('0' + group);
    }
  }
  return text;
}

}  // namespace terracast::exporters
