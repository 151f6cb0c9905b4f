#include "export/mcap/cdr.h"

#include <bit>

namespace terracast::exporters {

static_assert(std::endian::native == std::endian::little);

void CdrWriter::align(std::size_t size) {
  constexpr std::size_t kHeadBytes = 4;
  const std::size_t over = (bytes_.size() - kHeadBytes) % size;
  if (over > 0) bytes_.resize(bytes_.size() + size - over);
}

CdrWriter& CdrWriter::array(std::span<const double> numbers) {
  for (const double number : numbers) put(number);
  return *this;
}

CdrWriter& CdrWriter::sequence(std::span<const double> numbers) {
  return put(static_cast<std::uint32_t>(numbers.size())).array(numbers);
}

CdrWriter& CdrWriter::sequence(std::span<const std::byte> bytes) {
  put(static_cast<std::uint32_t>(bytes.size()));
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return *this;
}

CdrWriter& CdrWriter::text(std::string_view words) {
  put(static_cast<std::uint32_t>(words.size() + 1));
  for (const char letter : words) bytes_.push_back(static_cast<std::byte>(letter));
  bytes_.push_back(std::byte{0});
  return *this;
}

}  // namespace terracast::exporters
