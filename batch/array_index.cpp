#include "batch/array_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "core/error.h"

namespace terracast::batch {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMaxDigits = 9;

/// -1: it is none.
int number_from(const std::string& text) {
  if (text.empty() || text.size() > kMaxDigits ||
      text.find_first_not_of("0123456789") != std::string::npos)
    return -1;
  return std::stoi(text);
}

/// A queue's variables; null: it has none of that kind.
struct Queue {
  const char* index;
  const char* first;
  const char* last;
  const char* step;
  const char* num_tasks;
};
constexpr Queue kQueues[] = {
    {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX", "SLURM_ARRAY_TASK_STEP",
     "SLURM_ARRAY_TASK_COUNT"},
    {"SGE_TASK_ID", "SGE_TASK_FIRST", "SGE_TASK_LAST", "SGE_TASK_STEPSIZE", nullptr},
    {"PBS_ARRAY_INDEX", nullptr, nullptr, nullptr, nullptr},
    {"PBS_ARRAYID", nullptr, nullptr, nullptr, nullptr},
    {"JOB_COMPLETION_INDEX", nullptr, nullptr, nullptr, nullptr},
};

using Variable = std::function<std::optional<std::string>(const char*)>;

int number_of(const Variable& variable, const char* name) {
  const auto value = variable(name).value_or("");
  const int number = number_from(value);
  if (number < 0)
    fail(ErrorKind::Usage, "{} = \"{}\" is no number; give the part with --shard INDEX/COUNT", name,
         value);
  return number;
}

/// Of a queue that tells its array's first and last task.
/// count   as of part_from_queue()
Part part_in_array(const Queue& queue, const Variable& variable, int count) {
  const int index = number_of(variable, queue.index);
  const int first = number_of(variable, queue.first);
  const int last = number_of(variable, queue.last);
  const int step = std::max(1, number_of(variable, queue.step));
  const Part part{.index = (index - first) / step, .count = (last - first) / step + 1};
  const bool tells_number = queue.num_tasks != nullptr && variable(queue.num_tasks);
  const int num_tasks = tells_number ? number_of(variable, queue.num_tasks) : part.count;
  const bool has_holes = num_tasks != part.count || (index - first) % step != 0;
  if (has_holes && count == 0)
    fail(ErrorKind::Usage,
         "the array's tasks {} to {} have holes, whose parts nobody would do; give an array "
         "without holes, or, where these are some of COUNT tasks counted from 0, --parts COUNT",
         first, last);
  // Some of the tasks of a larger array, started again: one, neighbours, or others. An array that begins as whole ones do
  // has a wrong number of tasks instead.
  const bool is_of_larger = count > part.count && (first > 1 || part.count == 1);
  if (count != 0 && (has_holes || is_of_larger)) return {.index = index, .count = count};
  if (count != 0 && count != part.count)
    fail(ErrorKind::Usage, "--parts {}: this array has {} tasks ({})", count, part.count,
         queue.index);
  return part;
}

}  // namespace

int part_begin(std::size_t num_things, int index, int num_parts) {
  return static_cast<int>(static_cast<std::int64_t>(num_things) * index / num_parts);
}

Part part_from_text(const std::string& text) {
  const auto slash = text.find('/');
  const int index = number_from(text.substr(0, slash));
  const int count = slash == std::string::npos ? -1 : number_from(text.substr(slash + 1));
  if (index < 0 || index >= count)
    fail(ErrorKind::Usage,
         "--shard {}: parts are written INDEX/COUNT and counted from 0, as 0/4 to 3/4", text);
  return {.index = index, .count = count};
}

std::optional<Part> part_from_queue(
    const std::function<std::optional<std::string>(const char*)>& variable, int count) {
  for (const Queue& queue : kQueues) {
    const auto text = variable(queue.index);
    if (!text || text->empty() || *text == "undefined") continue;  // SGE outside of arrays
    if (queue.first == nullptr && count == 0)
      fail(ErrorKind::Usage,
           "{} = {}, but nothing tells how many tasks there are; give it with --parts COUNT",
           queue.index, *text);
    const Part part = queue.first != nullptr
                          ? part_in_array(queue, variable, count)
                          : Part{.index = number_of(variable, queue.index), .count = count};
    if (part.index < 0 || part.index >= part.count)
      fail(ErrorKind::Usage,
           "{} = {} is outside an array of {} tasks counted from 0; give the part with --shard "
           "INDEX/COUNT (of an array counted from 1, one less than the task's number)",
           queue.index, *text, part.count);
    return part;
  }
  if (count != 0)
    fail(ErrorKind::Usage,
         "--parts {}: no variable of an array tells which of them this is (PBS_ARRAY_INDEX, "
         "JOB_COMPLETION_INDEX and others); give the part with --shard INDEX/COUNT",
         count);
  return std::nullopt;
}

}  // namespace terracast::batch
