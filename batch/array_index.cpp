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
};
constexpr Queue kQueues[] = {
    {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX",
     "SLURM_ARRAY_TASK_STEP"},
    {"SGE_TASK_ID", "SGE_TASK_FIRST", "SGE_TASK_LAST", "SGE_TASK_STEPSIZE"},
    {"PBS_ARRAY_INDEX", nullptr, nullptr, nullptr},
    {"PBS_ARRAYID", nullptr, nullptr, nullptr},
    {"JOB_COMPLETION_INDEX", nullptr, nullptr, nullptr},
};

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
    const auto number = [&](const char* name) -> int {
      const auto value = variable(name).value_or("");
      const int parsed = number_from(value);
      if (parsed < 0)
        fail(ErrorKind::Usage, "{} = \"{}\" is no number; give the part with --shard INDEX/COUNT",
             name, value);
      return parsed;
    };
    Part part{.index = number(queue.index), .count = count};
    if (queue.first != nullptr) {
      const int first = number(queue.first);
      const int step = std::max(1, number(queue.step));
      part.index = (part.index - first) / step;
      part.count = (number(queue.last) - first) / step + 1;
      if (count != 0 && count != part.count)
        fail(ErrorKind::Usage, "--parts {}: this array has {} tasks ({})", count, part.count,
             queue.index);
    } else if (count == 0) {
      fail(ErrorKind::Usage,
           "{} = {}, but nothing tells how many tasks there are; give it with --parts COUNT",
           queue.index, *text);
    }
    if (part.index < 0 || part.index >= part.count)
      fail(ErrorKind::Usage,
           "{} = {} is outside an array of {} tasks counted from 0; give the part with --shard "
           "INDEX/COUNT",
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
