#include "tests/support/bag_reader.h"

#include <sstream>

#include "core/error.h"
#include "tests/support/run_program.h"

namespace terracast::test {

std::vector<const core::Json*> Bag::of(const std::string& topic) const {
  std::vector<const core::Json*> found;
  for (const core::Json& message : messages)
    if (message.at("topic").string() == topic) found.push_back(&message);
  return found;
}

Bag read_bag(const std::filesystem::path& file) {
  const ProgramResult read = run_command(
      TERRACAST_BAG_NODE,
      {TERRACAST_SOURCE_DIR "/tests/mcap/read_bag.mjs", TERRACAST_BAG_PACKAGES, file.string()});
  if (read.status != 0)
    core::fail(core::ErrorKind::Input, "{}: {}", file.string(), read.output.substr(0, 2000));
  Bag bag;
  std::istringstream lines(read.output);
  std::string line;
  std::getline(lines, line);
  bag.summary = core::Json::parse(line, "summary");
  while (std::getline(lines, line)) bag.messages.push_back(core::Json::parse(line, "message"));
  return bag;
}

std::vector<std::byte> bytes_of_hex(const std::string& digits) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

std::int64_t stamp_ns(const core::Json& message) {
  const core::Json& stamp = message.at("fields").at("header").at("stamp");
  return stamp.at("sec").integer() * 1'000'000'000 + stamp.at("nanosec").integer();
}

}  // namespace terracast::test
