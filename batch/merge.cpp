#include "batch/merge.h"

#include "batch/checksums.h"
#include "core/atomic_file.h"

namespace terracast::batch {

using core::ErrorKind;
using core::fail;

ShardResult merge(const Plan& plan, const JobFolder& folder, const core::Context& context) {
  std::vector<core::FileChecksum> checksums;
  const std::vector<DamagedFile> damaged = find_damaged(plan, folder, context, checksums);
  if (!damaged.empty())
    fail(ErrorKind::Input,
         "{}: {} {}, and {} files in all are not as they were exported; `terracast batch verify {} "
         "--repair` has them made again",
         folder.dataset().string(), damaged.front().path, damaged.front().what, damaged.size(),
         folder.root.string());
  const std::string lines = core::checksum_lines(std::move(checksums));
  core::write_file(folder.dataset() / "SHA256SUMS", lines);
  return {.num_frames = plan.num_frames(), .bytes = static_cast<double>(lines.size())};
}

}  // namespace terracast::batch
