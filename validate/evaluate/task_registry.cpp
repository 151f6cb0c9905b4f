#include <algorithm>

#include "validate/evaluate/task.h"

// One line a task, alphabetical; the file is tasks/<name>.cpp and defines make_<name>_task(). The
// word is what stands after --task.
#define TERRACAST_TASKS(X)                                                               \
  X(cloud, "cloud", "points: Chamfer distance, accuracy, completeness, F-score")         \
  X(depth, "depth", "planar depth: AbsRel, SqRel, RMSE, delta 1.25 (Eigen et al. 2014)") \
  X(flow, "flow", "optical flow: EPE2D, F1-all (KITTI 2015)")                            \
  X(scene_flow, "scene-flow", "scene flow: EPE2D, F1-all, EPE3D, delta3D at 5 and 10 m") \
  X(trajectory, "trajectory", "camera poses: ATE, RPE (Sturm et al. 2012), KITTI odometry's drift")

namespace terracast::validate {

#define TERRACAST_DECLARE(name, word, summary) \
  std::unique_ptr<Task> make_##name##_task(const EvaluateOptions&);
TERRACAST_TASKS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const TaskInfo> tasks() {
#define TERRACAST_ROW(name, word, summary) {word, summary, &make_##name##_task},
  static constexpr TaskInfo kTable[] = {TERRACAST_TASKS(TERRACAST_ROW)};
#undef TERRACAST_ROW
  return kTable;
}

std::vector<NameAndSummary> task_list() {
  std::vector<NameAndSummary> list;
  for (const TaskInfo& info : tasks()) list.push_back({info.name, info.summary});
  return list;
}

std::vector<std::string> task_names() {
  std::vector<std::string> names;
  for (const TaskInfo& info : tasks()) names.emplace_back(info.name);
  return names;
}

}  // namespace terracast::validate
