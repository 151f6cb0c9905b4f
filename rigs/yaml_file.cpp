#include "rigs/yaml_file.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <sstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/text.h"
#include "rigs/opencv_xml.h"

namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostBytes = std::size_t{1} << 22;
/// In one list: aliases make much of few bytes.
constexpr std::size_t kMostNumbers = 1000;

/// OpenCV's parser takes a key up to its colon, whatever follows: "Viewer.PointSize:2", "data:[1, 2]".
std::string with_blanks_after_keys(const std::string& text) {
  std::string blank;
  blank.reserve(text.size());
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    const std::string_view line(text.data() + begin, end - begin);
    const std::size_t key = line.find_first_not_of(' ');
    const std::size_t colon = std::min(line.find(':'), line.size());
    const bool is_plain =
        colon > key && std::all_of(line.begin() + static_cast<std::ptrdiff_t>(std::min(key, colon)),
                                   line.begin() + static_cast<std::ptrdiff_t>(colon), [](char c) {
                                     return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
                                            c == '_' || c == '.' || c == '-';
                                   });
    const bool is_joined = is_plain && colon + 1 < line.size() &&
                           std::isspace(static_cast<unsigned char>(line[colon + 1])) == 0;
    blank += is_joined ? fmt::format("{}: {}", line.substr(0, colon), line.substr(colon + 1))
                       : std::string(line);
    begin = end;
  }
  return blank;
}

/// OpenCV writes a directive that YAML does not know, "%YAML:1.0"; editors a byte order mark.
std::string without_directive(std::string text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  if (!text.starts_with("%YAML:")) return text;
  const std::size_t end = std::min(text.find('\n'), text.size());
  text.replace(0, end, std::string(end, ' '));
  return with_blanks_after_keys(text);
}

/// Where a document begins with what none may begin with, such as a comma, yaml-cpp makes an empty one and begins there
/// once more, without end.
class DocumentStarts final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (mark.pos == last_) throw YAML::ParserException(mark, "no document may begin like this");
    last_ = mark.pos;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  int last_ = -1;
};

std::vector<YAML::Node> documents_of(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentStarts starts;
  while (parser.HandleNextDocument(starts)) {
  }
  return YAML::LoadAll(text);
}

}  // namespace

YamlValue::YamlValue(std::shared_ptr<File> file, KeyRecord::Path path, const YAML::Node& node)
    : file_(std::move(file)),
      path_(std::move(path)),
      node_(std::make_shared<const YAML::Node>(node)) {}

YamlValue YamlValue::read(const std::filesystem::path& file) {
  const std::string text = core::read_text_file(file, kMostBytes);
  try {
    if (is_opencv_xml(text))
      return {std::make_shared<File>(File{file.string(), 0, {}}),
              {},
              node_of_opencv_xml(text, file.string())};
    const std::vector<YAML::Node> documents = documents_of(without_directive(text));
    const auto is_stated = [](const YAML::Node& document) { return !document.IsNull(); };
    const auto num_stated = std::count_if(documents.begin(), documents.end(), is_stated);
    const auto first = std::find_if(documents.begin(), documents.end(), is_stated);
    const std::size_t num_others = num_stated > 1 ? static_cast<std::size_t>(num_stated) - 1 : 0;
    return {std::make_shared<File>(File{file.string(), num_others, {}}),
            {},
            first == documents.end() ? YAML::Node() : *first};
  } catch (const YAML::Exception& error) {
    fail(ErrorKind::Input, "{}:{}:{}: no YAML: {}", file.string(), error.mark.line + 1,
         error.mark.column + 1, error.msg);
  }
}

std::unique_ptr<YamlValue> yaml_map_of(const std::filesystem::path& file) {
  constexpr std::array kExtensions = {".yaml", ".yml", ".xml", ".json"};
  if (!std::filesystem::is_regular_file(file) ||
      std::find(kExtensions.begin(), kExtensions.end(), file.extension()) == kExtensions.end())
    return nullptr;
  const bool is_xml = file.extension() == ".xml";
  if (is_xml && !is_opencv_xml(core::read_text_file(file, kMostBytes))) return nullptr;
  try {
    auto value = std::make_unique<YamlValue>(YamlValue::read(file));
    if (!value->is_map()) return nullptr;
    value->keys();  // looks for those that stand twice
    return value;
  } catch (const core::Error& error) {
    // What is JSON of something else is nobody's damaged calibration.
    if (file.extension() != ".json" || error.kind() != ErrorKind::Input) throw;
    return nullptr;
  }
}

std::string YamlValue::where() const {
  const int line = node_->Mark().line;
  std::string path;
  for (const std::string& step : path_)
    path += (path.empty() || step.starts_with('[') ? "" : ".") + step;
  return fmt::format("{}{}{}", file_->path, line >= 0 ? fmt::format(":{}", line + 1) : "",
                     path.empty() ? "" : ": " + path);
}

bool YamlValue::is_map() const { return node_->IsMap(); }
bool YamlValue::is_list() const { return node_->IsSequence(); }
bool YamlValue::is_null() const { return node_->IsNull(); }

/// Tells the record which keys the map has, when it is looked into first.
void YamlValue::open() const {
  if (file_->record.is_open(path_)) return;
  std::vector<std::string> keys;
  for (const auto& entry : *node_)
    keys.push_back(entry.first.IsScalar() ? entry.first.Scalar()
                                          : fmt::format("(a key in line {} that is no text)",
                                                        entry.first.Mark().line + 1));
  file_->record.open(path_, keys, where());
}

bool YamlValue::has(std::string_view key) const {
  if (!node_->IsMap()) return false;
  open();
  return (*node_)[std::string(key)].IsDefined();
}

bool YamlValue::states(std::string_view key) const {
  return has(key) && !(*node_)[std::string(key)].IsNull();
}

YamlValue YamlValue::at(std::string_view key) const {
  if (!node_->IsMap()) fail(ErrorKind::Input, "{} is no map; one with {} is wanted", where(), key);
  open();
  const YAML::Node node = (*node_)[std::string(key)];
  if (!node.IsDefined()) fail(ErrorKind::Input, "{} has no {}", where(), key);
  KeyRecord::Path path = path_;
  path.emplace_back(key);
  file_->record.take(path);
  return {file_, std::move(path), node};
}

std::vector<std::string> YamlValue::keys() const {
  if (!node_->IsMap()) fail(ErrorKind::Input, "{} is no map", where());
  open();
  std::vector<std::string> keys;
  for (const auto& entry : *node_)
    if (entry.first.IsScalar()) keys.push_back(entry.first.Scalar());
  return keys;
}

std::vector<YamlValue> YamlValue::items() const {
  if (!node_->IsSequence()) fail(ErrorKind::Input, "{} is no list", where());
  if (node_->size() > kMostNumbers)
    fail(ErrorKind::Input, "{} has more than {} numbers or items; no camera takes so many", where(),
         kMostNumbers);
  std::vector<YamlValue> items;
  for (std::size_t i = 0; i < node_->size(); ++i) {
    KeyRecord::Path path = path_;
    path.push_back(fmt::format("[{}]", i));
    items.push_back({file_, std::move(path), (*node_)[i]});
  }
  return items;
}

void YamlValue::pass_over(const std::string& why) const { file_->record.pass_over(path_, why); }

void YamlValue::leave_out(const std::string& part, const std::string& why) const {
  file_->record.leave_out(path_, part, why);
}

void YamlValue::misunderstand(const std::string& value) const {
  file_->record.misunderstand(path_, value);
}

core::Ledger YamlValue::ledger(std::span<const core::KnownName> known,
                               std::string (*name)(const KeyRecord::Path&)) const {
  core::Ledger ledger = file_->record.ledger(known, name);
  if (file_->num_other_documents > 0)
    ledger.ignore("(documents after the first)", "a rig is read from the first one of a file",
                  static_cast<std::int64_t>(file_->num_other_documents));
  return ledger;
}

std::string YamlValue::text() const {
  if (!node_->IsScalar()) fail(ErrorKind::Input, "{} is no text", where());
  return node_->Scalar();
}

double YamlValue::number() const {
  if (node_->IsScalar())
    if (const auto value = geo::number_of(node_->Scalar())) return *value;
  fail(ErrorKind::Input, "{} is no finite number", where());
}

int YamlValue::size_px() const {
  const double value = number();
  if (!(value >= 1.0 && value <= 16384.0 && value == std::floor(value)))
    fail(ErrorKind::Input, "{} = {}; the side of an image has 1 to 16384 pixels", where(), value);
  return static_cast<int>(value);
}

std::vector<double> YamlValue::numbers(std::size_t count) const {
  std::vector<double> values;
  for (const YamlValue& item : items()) {
    if (values.size() > kMostNumbers)
      fail(ErrorKind::Input, "{} has more than {} numbers or items; no camera takes so many",
           where(), kMostNumbers);
    if (item.node_->IsSequence()) {
      for (const YamlValue& inner : item.items()) values.push_back(inner.number());
    } else {
      values.push_back(item.number());
    }
  }
  if (count != 0 && values.size() != count)
    fail(ErrorKind::Input, "{} has {} numbers; it takes {}", where(), values.size(), count);
  return values;
}

std::vector<double> YamlValue::matrix(std::size_t count) const {
  if (is_list()) return numbers(count);
  const std::vector<double> values = at("data").numbers(count);
  for (const char* key : {"dt", "type_id"})  // of what type the numbers were
    if (has(key)) at(key).text();
  if (!has("rows") || !has("cols")) return values;
  const double rows = at("rows").number(), cols = at("cols").number();
  if (rows * cols != static_cast<double>(values.size()))
    fail(ErrorKind::Input, "{} has {} numbers; {} rows of {} are {}", at("data").where(),
         values.size(), rows, cols, rows * cols);
  return values;
}

geo::Rigid3d YamlValue::rigid() const {
  const std::vector<double> m = matrix();
  if (m.size() != 12 && m.size() != 16)
    fail(ErrorKind::Input, "{} has {} numbers; it takes 3 or 4 rows of 4", where(), m.size());
  if (m.size() == 16 && (m[12] != 0.0 || m[13] != 0.0 || m[14] != 0.0 || m[15] != 1.0))
    fail(ErrorKind::Input,
         "{}: its last row is {} {} {} {}; that of a pose is 0 0 0 1 (written column by column, it "
         "would hold the translation)",
         where(), m[12], m[13], m[14], m[15]);
  return rigid({m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]});
}

geo::Rigid3d YamlValue::rigid(const std::vector<double>& rotation,
                              const std::vector<double>& translation) const {
  constexpr double kPrintedRotation = 1e-3;
  const Eigen::Matrix3d given =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
  const double error = (given.transpose() * given - Eigen::Matrix3d::Identity()).norm();
  if (!(error < kPrintedRotation) || given.determinant() < 0.0)
    fail(ErrorKind::Input,
         "{} holds no rotation: its columns are not right-handed unit vectors at right angles",
         where());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(given, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {.rotation = Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()))
                          .normalized(),
          .translation = {translation[0], translation[1], translation[2]}};
}

}  // namespace terracast::rigs
