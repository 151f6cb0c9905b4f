#include "core/json.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <unordered_set>
#include <variant>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"

namespace terracast::core {

namespace {

/// Deeper nesting than any file of ours; it bounds the recursion over hostile ones.
constexpr std::size_t kMaxDepth = 200;

/// Where a parsed value stood, as a chain of steps up to the file's name.
struct Origin {
  std::shared_ptr<const Origin> parent;
  std::string step;  ///< the file's name, ".member" or "[index]"
};

using Members = std::vector<std::pair<std::string, Json>>;
using Items = std::vector<Json>;

}  // namespace

struct Json::Value {
  std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, Items,
               Members>
      data;
  std::shared_ptr<const Origin> origin;

  /// "cameras.json: frames[2].time_s", or "the value" for one that was not parsed.
  std::string place() const {
    std::string path;
    for (const Origin* at = origin.get(); at != nullptr; at = at->parent.get()) {
      if (at->parent == nullptr) {
        if (path.starts_with('.')) path.erase(0, 1);
        return at->step + ": " + (path.empty() ? "the top value" : path);
      }
      path.insert(0, at->step);
    }
    return "the value";
  }

  std::string type_name() const {
    static constexpr const char* kNames[] = {"null",           "true or false", "a whole number",
                                             "a whole number", "a number",      "text",
                                             "a list",         "an object"};
    return kNames[data.index()];
  }

  [[noreturn]] void refuse(const char* wanted) const {
    fail(ErrorKind::Input, "{} is {}, but must be {}", place(), type_name(), wanted);
  }

  void write(std::string& out, int indent, int level) const;

  /// Gives every parsed value its place, once the tree stands still.
  static void set_origins(Json& json, const std::shared_ptr<const Origin>& origin) {
    Value& value = *json.value_;
    value.origin = origin;
    if (auto* members = std::get_if<Members>(&value.data)) {
      for (auto& [name, member] : *members)
        set_origins(member, std::make_shared<const Origin>(Origin{origin, "." + name}));
    } else if (auto* items = std::get_if<Items>(&value.data)) {
      for (std::size_t i = 0; i < items->size(); ++i)
        set_origins((*items)[i],
                    std::make_shared<const Origin>(Origin{origin, fmt::format("[{}]", i)}));
    }
  }

  /// What nlohmann's parser calls: builds the tree, and refuses what it would let pass.
  class Builder;
};

class Json::Value::Builder : public nlohmann::json_sax<nlohmann::json> {
 public:
  Builder(std::string_view text, const std::string& name, std::size_t most_values)
      : text_(text), name_(name), most_values_(most_values) {}

  Json take() { return std::move(root_); }

  bool null() override { return add(Json()); }
  bool boolean(bool value) override { return add(Json(value)); }
  bool number_integer(number_integer_t value) override { return add(Json(std::int64_t{value})); }
  bool number_unsigned(number_unsigned_t value) override { return add(Json(std::uint64_t{value})); }
  bool number_float(number_float_t value, const string_t&) override { return add(Json(value)); }
  bool string(string_t& value) override { return add(Json(value)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    if (!open_.back().names.insert(name).second)
      fail(ErrorKind::Input, "{}: the member \"{}\" stands twice in one object", name_, name);
    open_.back().name = name;
    return true;
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    // nlohmann counts bytes from 1 up to and with the one it stopped at.
    const std::string_view before = text_.substr(0, std::min(position, text_.size() + 1) - 1);
    const auto line = std::count(before.begin(), before.end(), '\n') + 1;
    const std::size_t line_start = before.rfind('\n') + 1;  // npos + 1 is 0
    std::string what = error.what();
    if (const std::size_t at = what.find(": "); at != std::string::npos) what.erase(0, at + 2);
    fail(ErrorKind::Input, "{}:{}:{}: not JSON: {}", name_, line, before.size() - line_start + 1,
         what);
  }

 private:
  struct Open {
    Json value;
    std::string name;  ///< the member that comes next
    std::unordered_set<std::string> names;
  };

  bool open(Json value) {
    if (open_.size() >= kMaxDepth)
      fail(ErrorKind::Input, "{}: nested deeper than {} levels", name_, kMaxDepth);
    open_.push_back({std::move(value), {}, {}});
    return true;
  }
  bool close() {
    Json value = std::move(open_.back().value);
    open_.pop_back();
    return add(std::move(value));
  }
  bool add(Json value) {
    if (++num_values_ > most_values_)
      fail(ErrorKind::Input,
           "{}: holds more than {} values, and up to that many fit into memory; split it, or leave "
           "out what is not needed",
           name_, most_values_);
    if (open_.empty()) {
      root_ = std::move(value);
      return true;
    }
    auto& data = open_.back().value.value_->data;
    if (auto* members = std::get_if<Members>(&data))
      members->emplace_back(open_.back().name, std::move(value));
    else
      std::get<Items>(data).push_back(std::move(value));
    return true;
  }

  std::string_view text_;
  const std::string& name_;
  const std::size_t most_values_;
  Json root_;
  std::size_t num_values_ = 0;
  std::vector<Open> open_;
};

Json::Json() : value_(std::make_unique<Value>()) {}
Json::Json(bool value) : Json() { value_->data = value; }
Json::Json(int value) : Json(std::int64_t{value}) {}
Json::Json(std::int64_t value) : Json() { value_->data = value; }
Json::Json(std::uint64_t value) : Json() {
  if (value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
    value_->data = static_cast<std::int64_t>(value);
  else
    value_->data = value;
}
Json::Json(double value) : Json() { value_->data = value; }
Json::Json(const char* value) : Json(std::string_view(value)) {}
Json::Json(std::string_view value) : Json() { value_->data = std::string(value); }
Json::Json(const std::string& value) : Json(std::string_view(value)) {}
Json::Json(const Json& other)
    : value_(other.value_ ? std::make_unique<Value>(*other.value_) : std::make_unique<Value>()) {}
Json::Json(Json&&) noexcept = default;
Json& Json::operator=(Json other) {
  value_.swap(other.value_);
  return *this;
}
Json::~Json() = default;

Json Json::object() {
  Json json;
  json.value_->data = Members();
  return json;
}

Json Json::array() {
  Json json;
  json.value_->data = Items();
  return json;
}

Json Json::array_of(const std::vector<double>& values) {
  Json json = array();
  for (const double value : values) json.push(value);
  return json;
}

Json Json::array_of(const std::vector<std::string>& values) {
  Json json = array();
  for (const std::string& value : values) json.push(value);
  return json;
}

namespace {

/// Values that half of the machine's memory holds.
std::size_t values_that_fit() {
  constexpr std::size_t kBytes = 200;  ///< of a value
  const auto pages = static_cast<std::size_t>(std::max(::sysconf(_SC_PHYS_PAGES), 0L));
  const auto page_bytes = static_cast<std::size_t>(std::max(::sysconf(_SC_PAGESIZE), 0L));
  return pages * page_bytes / 2 / kBytes;
}

}  // namespace

Json Json::parse(std::string_view text, const std::string& name, std::size_t most_values) {
  if (most_values > kMostValues)
    most_values = std::min(most_values, std::max(kMostValues, values_that_fit()));
  Value::Builder builder(text, name, most_values);
  nlohmann::json::sax_parse(text.begin(), text.end(), &builder);
  Json json = builder.take();
  Value::set_origins(json, std::make_shared<const Origin>(Origin{nullptr, name}));
  return json;
}

Json Json::read(const std::filesystem::path& file, std::size_t most_values) {
  return parse(read_text_file(file), file.string(), most_values);
}

void Json::Value::write(std::string& out, int indent, int level) const {
  const auto write_text = [&out, this](const std::string& text) {
    try {
      out += nlohmann::json(text).dump();
    } catch (const nlohmann::json::exception&) {
      fail(ErrorKind::Input, "{}: text for JSON must be UTF-8: {}", place(),
           nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
    }
  };
  const auto new_line = [&out, indent](int depth) {
    if (indent < 0) return;
    out += '\n';
    out.append(static_cast<std::size_t>(indent) * static_cast<std::size_t>(depth), ' ');
  };
  if (std::holds_alternative<std::monostate>(data)) {
    out += "null";
  } else if (const auto* boolean = std::get_if<bool>(&data)) {
    out += *boolean ? "true" : "false";
  } else if (const auto* integer = std::get_if<std::int64_t>(&data)) {
    out += fmt::to_string(*integer);
  } else if (const auto* natural = std::get_if<std::uint64_t>(&data)) {
    out += fmt::to_string(*natural);
  } else if (const auto* number = std::get_if<double>(&data)) {
    if (!std::isfinite(*number))
      fail(ErrorKind::Internal, "{} has no form in JSON: write null or text instead", *number);
    char digits[40];
    const auto end = std::to_chars(digits, digits + sizeof digits, *number).ptr;
    const std::string_view shortest(digits, static_cast<std::size_t>(end - digits));
    out += shortest;
    // Readers keep whole numbers apart, and a whole -0 loses its sign.
    if (shortest.find_first_of(".e") == std::string_view::npos) out += ".0";
  } else if (const auto* text = std::get_if<std::string>(&data)) {
    write_text(*text);
  } else if (const auto* items = std::get_if<Items>(&data)) {
    // A list of plain values stands in one line.
    bool flat = true;
    for (const Json& item : *items) flat = flat && !item.is_object() && !item.is_array();
    out += '[';
    for (std::size_t i = 0; i < items->size(); ++i) {
      if (i > 0) out += indent >= 0 && flat ? ", " : ",";
      if (!flat) new_line(level + 1);
      (*items)[i].value_->write(out, indent, level + 1);
    }
    if (!flat) new_line(level);
    out += ']';
  } else {
    const Members& members = std::get<Members>(data);
    out += '{';
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (i > 0) out += ',';
      new_line(level + 1);
      write_text(members[i].first);
      out += indent < 0 ? ":" : ": ";
      members[i].second.value_->write(out, indent, level + 1);
    }
    if (!members.empty()) new_line(level);
    out += '}';
  }
}

std::string Json::text(int indent) const {
  std::string out;
  value_->write(out, indent, 0);
  return out;
}

void Json::write(const std::filesystem::path& file, int indent) const {
  write_file(file, text(indent) + "\n");
}

Json& Json::set(std::string_view member, Json value) {
  auto* members = std::get_if<Members>(&value_->data);
  TERRACAST_CHECK(members != nullptr, "\"{}\" is set on {}", member, value_->type_name());
  for (auto& [name, present] : *members)
    if (name == member) {
      present = std::move(value);
      return *this;
    }
  members->emplace_back(std::string(member), std::move(value));
  return *this;
}

Json& Json::push(Json value) {
  auto* items = std::get_if<Items>(&value_->data);
  TERRACAST_CHECK(items != nullptr, "pushed to {}", value_->type_name());
  items->push_back(std::move(value));
  return *this;
}

bool Json::is_null() const { return std::holds_alternative<std::monostate>(value_->data); }
bool Json::is_object() const { return std::holds_alternative<Members>(value_->data); }
bool Json::is_array() const { return std::holds_alternative<Items>(value_->data); }

bool Json::has(std::string_view member) const {
  const auto* found = std::get_if<Members>(&value_->data);
  if (found == nullptr) return false;
  return std::any_of(found->begin(), found->end(),
                     [&](const auto& entry) { return entry.first == member; });
}

std::size_t Json::size() const {
  if (const auto* items = std::get_if<Items>(&value_->data)) return items->size();
  if (const auto* found = std::get_if<Members>(&value_->data)) return found->size();
  return 0;
}

const Json& Json::at(std::string_view member) const {
  const auto* found = std::get_if<Members>(&value_->data);
  if (found == nullptr) value_->refuse("an object");
  for (const auto& [name, value] : *found)
    if (name == member) return value;
  fail(ErrorKind::Input, "{} has no member \"{}\"", value_->place(), member);
}

const Json& Json::at(std::size_t index) const {
  const auto* items = std::get_if<Items>(&value_->data);
  if (items == nullptr) value_->refuse("a list");
  if (index >= items->size())
    fail(ErrorKind::Input, "{} has {} items, but item {} is wanted", value_->place(), items->size(),
         index);
  return (*items)[index];
}

const std::vector<std::pair<std::string, Json>>& Json::members() const {
  const auto* found = std::get_if<Members>(&value_->data);
  if (found == nullptr) value_->refuse("an object");
  return *found;
}

bool Json::boolean() const {
  const auto* value = std::get_if<bool>(&value_->data);
  if (value == nullptr) value_->refuse("true or false");
  return *value;
}

double Json::number() const {
  if (const auto* integer = std::get_if<std::int64_t>(&value_->data))
    return static_cast<double>(*integer);
  if (const auto* natural = std::get_if<std::uint64_t>(&value_->data))
    return static_cast<double>(*natural);
  const auto* value = std::get_if<double>(&value_->data);
  if (value == nullptr) value_->refuse("a number");
  return *value;
}

std::int64_t Json::integer() const {
  const auto* value = std::get_if<std::int64_t>(&value_->data);
  if (value != nullptr) return *value;
  if (const auto* natural = std::get_if<std::uint64_t>(&value_->data))
    fail(ErrorKind::Input, "{} = {} is too large a whole number", value_->place(), *natural);
  value_->refuse("a whole number");
}

const std::string& Json::string() const {
  const auto* value = std::get_if<std::string>(&value_->data);
  if (value == nullptr) value_->refuse("text");
  return *value;
}

std::vector<double> Json::numbers() const {
  const auto* items = std::get_if<Items>(&value_->data);
  if (items == nullptr) value_->refuse("a list of numbers");
  std::vector<double> values;
  values.reserve(items->size());
  for (const Json& item : *items) values.push_back(item.number());
  return values;
}

std::vector<std::string> Json::strings() const {
  const auto* items = std::get_if<Items>(&value_->data);
  if (items == nullptr) value_->refuse("a list of texts");
  std::vector<std::string> values;
  values.reserve(items->size());
  for (const Json& item : *items) values.push_back(item.string());
  return values;
}

namespace {

constexpr const char* kHashMember = "content_hash";

std::string hash_of_members(const Json& object) {
  Json hashed = Json::object();
  for (const auto& [name, value] : object.members())
    if (name != kHashMember) hashed.set(name, value);
  return content_hash(hashed.text(-1));
}

}  // namespace

void add_content_hash(Json& object) { object.set(kHashMember, hash_of_members(object)); }

void check_content_hash(const Json& object) {
  const std::string& stated = object.at(kHashMember).string();
  if (const std::string hash = hash_of_members(object); stated != hash)
    fail(ErrorKind::Input, "damaged or edited: {} {} where its content has {}", kHashMember, stated,
         hash);
}

}  // namespace terracast::core
