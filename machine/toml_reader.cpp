// toml++ behind a narrow door: this is the only file that includes it.
#include "machine/toml_reader.h"

// toml++ asserts of what it reads, such as that '[' opens a name, and would end a debug build for a file that is wrong;
// the next thing it does is to refuse that file in words.
#define TOML_ASSERT(condition) static_assert(true)
#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "core/nearest_name.h"
#include "core/text.h"
#include "machine/file_text.h"

namespace knuckle {
namespace {

constexpr std::size_t kLongestText = 1000;  // characters
constexpr int kDeepest = 16;

/// Refuses text that toml++ would build too deep a tree of: it walks and destroys trees by recursion, and bounds only
/// values inside values, while "a.a.a ... = 1" makes as many tables as it has dots. Each array, inline table and dot
/// outside of strings and comments adds one level at most, a key ends with its line at the latest, and what follows the
/// first mistake in a text is never built. So no tree is deeper than 2 * kDeepest + (kDeepest + 1) * kDeepest.
class NestingCheck {
 public:
  NestingCheck(std::string_view text, const std::string& source) : text_(text), source_(source) {}

  void run() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"' || c == '\'') {
        skip_string(c);
        continue;
      }
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
        continue;
      }
      ++at_;
      if (c == '.' && ++dots_ == kDeepest) refuse_key();
      if ((c == '[' || c == '{') && ++open_ > kDeepest) refuse_values();
      if ((c == ']' || c == '}') && open_ > 0) --open_;
      if (c == '\n') ++line_;
      if (c == '\n' || c == '=' || c == ',' || c == '[' || c == '{') start_key();
    }
  }

 private:
  void start_key() {
    key_ = at_;
    dots_ = 0;
  }

  /// From its opening quote to behind its closing one, as TOML says; a string without one is left to the parser.
  void skip_string(char quote) {
    const std::string three(3, quote);
    const bool many_lines = text_.substr(at_, 3) == three;
    const std::string_view end = many_lines ? std::string_view(three) : std::string_view(three).substr(2);
    for (at_ += end.size(); at_ < text_.size(); ++at_) {
      if (text_[at_] == '\n') {
        if (!many_lines) return;
        ++line_;
      }
      if (text_[at_] == '\\' && quote == '"') {
        ++at_;  // whatever it is, it ends no string
        if (at_ < text_.size() && text_[at_] == '\n') ++line_;
      } else if (text_.substr(at_, end.size()) == end) {
        at_ += end.size();
        for (int more = 0; many_lines && more < 2 && at_ < text_.size() && text_[at_] == quote; ++more) ++at_;
        return;
      }
    }
  }

  [[noreturn]] void refuse_key() const {
    std::string_view key = text_.substr(key_, std::min(text_.find_first_of("=]\n", at_), text_.size()) - key_);
    key.remove_prefix(std::min(key.find_first_not_of(" \t"), key.size()));
    key = key.substr(0, key.find_last_not_of(" \t\r") + 1);
    refuse("key '" + shortened(key) + "': must be at most " + std::to_string(kDeepest) + " names joined by dots");
  }
  [[noreturn]] void refuse_values() const {
    refuse("arrays and tables inside each other: must be at most " + std::to_string(kDeepest) + " deep");
  }
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(source_ + ":" + std::to_string(line_) + ": " + what);
  }

  std::string_view text_;
  const std::string& source_;
  std::size_t at_ = 0, key_ = 0, line_ = 1;
  int dots_ = 0, open_ = 0;
};

/// As a person would write it. 17.0 is not 17: where a whole number is required, that is what is wrong.
std::string whole_value_text(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) return with_point(number_text(number->get()));
  if (node.is_table()) return "a table";
  if (node.is_array_of_tables()) {
    const std::size_t count = node.as_array()->size();
    return count == 1 ? "an array of one table" : "an array of " + std::to_string(count) + " tables";
  }
  if (const auto* array = node.as_array()) {
    std::string all;
    for (const toml::node& element : *array) all += (all.empty() ? "" : ", ") + whole_value_text(element);
    return "[" + all + "]";
  }
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}
std::string value_text(const toml::node& node) {
  return shortened(whole_value_text(node));
}

/// "within [50, 400]"; whole bounds with all their digits.
std::string within(double min, double max) {
  const auto bound = [](double value) {
    constexpr double kAllDigits = 1e15;
    const bool whole = value == std::floor(value) && std::abs(value) < kAllDigits;
    return whole ? std::to_string(static_cast<std::int64_t>(value)) : number_text(value);
  };
  return "within [" + bound(min) + ", " + bound(max) + "]";
}

std::optional<double> as_number(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* number = node.as_integer()) return static_cast<double>(number->get());
  return std::nullopt;
}

/// "m.toml:2:5: 'y = = 2': ...", with the line's text, as toml++ does not name the key.
std::string syntax_error(std::string_view text, const std::string& source, const toml::parse_error& error) {
  const auto [line, column] = error.source().begin;
  for (std::uint32_t at = 1; at < line && !text.empty(); ++at)
    text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  text = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r"), text.size()));
  text = text.substr(0, text.find_last_not_of(" \t\r") + 1);
  const std::string quoted = text.empty() ? "" : '\'' + shortened(text) + "': ";
  std::string why = printable(error.description());
  if (why.starts_with("Error while parsing floating-point") && why.ends_with("could not be interpreted as a value"))
    why += ": must be within [-1.8e308, 1.8e308]";
  return source + ":" + std::to_string(line) + ":" + std::to_string(column) + ": " + quoted + why;
}

/// Whether one of two paths is the other, or a table or array around it.
bool related(std::string_view a, std::string_view b) {
  if (a.size() > b.size()) std::swap(a, b);
  return b.starts_with(a) && (a.size() == b.size() || b[a.size()] == '.' || b[a.size()] == '[');
}

}  // namespace

std::string with_point(std::string digits) {
  return digits.find_first_not_of("-0123456789") == std::string::npos ? digits + ".0" : digits;
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 9).ptr;
  return {text.data(), end};
}

FileErrors::FileErrors(const std::string& first, std::vector<std::string> lines, const std::string& hint)
    : InputError(lines.size() == 1 ? first
                                   : first + " (first of " + std::to_string(lines.size()) + " errors" + hint + ")"),
      lines_(std::move(lines)) {}

/// One file: what is in it, and what was found wrong.
struct TomlTable::Document {
  static constexpr std::size_t kMostErrors = 100;  // beyond them another kind of file was meant

  toml::table root;
  std::string text, source;
  std::vector<std::pair<std::uint32_t, std::string>> errors;  ///< Line of the file, and what is said.
  std::vector<std::string> noted;                             ///< Paths of their keys.
  bool checked = true;

  void note(std::uint32_t line, const std::string& path, const std::string& what) {
    errors.emplace_back(line, source + ":" + std::to_string(line) + ": " + what);
    noted.push_back(path);
    if (errors.size() == kMostErrors) refuse();
  }
  [[nodiscard]] bool sound(std::string_view path) const {
    return std::none_of(noted.begin(), noted.end(), [&](const std::string& one) { return related(one, path); });
  }
  [[noreturn]] void refuse() const {
    auto in_order = errors;
    std::stable_sort(in_order.begin(), in_order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<std::string> lines;
    for (const auto& [line, what] : in_order) lines.push_back(what);
    throw FileErrors(errors.front().second, std::move(lines), checked ? "; knuckle check shows all" : "");
  }
};

struct TomlTable::Node {
  std::shared_ptr<Document> document;
  std::string path;          ///< "", or "links.boom." before a key.
  const toml::table* table;  ///< nullptr where it was noted that there is none: nothing in it is missed.
  std::set<std::string, std::less<>> asked = {}, looked_for = {};
  std::vector<std::shared_ptr<Node>> children = {};
  bool rest_left = false;

  void note(const toml::node& where, std::string_view key, const std::string& what) const {
    document->note(where.source().begin.line, path + std::string(key), name(key) + what);
  }
  [[nodiscard]] std::string name(std::string_view key) const {
    return "key '" + shortened(path + std::string(key)) + "'";
  }
  void refuse(std::string_view key, const toml::node& value, const std::string& bound) const {
    note(value, key, " = " + value_text(value) + ": " + bound);
  }

  /// nullptr where it is missing, which is noted. One that is misspelt is noted and read all the same.
  const toml::node* get(std::string_view key) {
    asked.emplace(key);
    if (table == nullptr) return nullptr;
    if (const toml::node* value = table->get(key)) return value;
    std::vector<std::string> others;
    for (const auto& [other, value] : *table) {
      if (!asked.contains(other.str())) others.emplace_back(other.str());
    }
    const auto typo = nearest_name(key, others, 1);
    const toml::node* found = typo ? table->get(*typo) : nullptr;
    note(typo ? *found : *table, key,
         std::string(" is missing") + (typo ? "; is '" + shortened(*typo) + "' here meant to be it?" : ""));
    if (typo) asked.insert(*typo);
    return found;
  }

  TomlTable child(const toml::table* below, std::string below_path) {
    children.push_back(std::make_shared<Node>(Node{document, std::move(below_path), below}));
    return TomlTable(children.back());
  }

  /// The key that a misspelt one was meant to be. One that was only looked for is spelt well, but does not go with the
  /// others; as a meant one it must be nearer, as it may be left out.
  [[nodiscard]] std::optional<std::string> meant_by(std::string_view key) const {
    if (looked_for.contains(key)) return std::nullopt;
    const std::vector<std::string> known(asked.begin(), asked.end()), optional(looked_for.begin(), looked_for.end());
    const auto meant = nearest_name(key, known);
    return meant ? meant : nearest_name(key, optional, key.size() / 5);
  }

  void finish() const {
    if (table == nullptr) return;
    for (const auto& [key, value] : *table) {
      if (asked.contains(key.str()) || rest_left) continue;
      const auto meant = meant_by(key.str());
      refuse(key.str(), value,
             meant ? "unknown key; did you mean '" + *meant + "'?"
                   : "unknown key, or one that does not go with the other keys here");
    }
    for (const auto& below : children) below->finish();
  }
};

TomlTable::TomlTable(std::shared_ptr<Node> node) : node_(std::move(node)) {}

TomlTable TomlTable::parse(std::string_view text, const std::string& source) {
  NestingCheck(text, source).run();
  try {
    auto document = std::make_shared<Document>(Document{toml::parse(text, source), std::string(text), source, {}, {}});
    const toml::table* root = &document->root;
    return TomlTable(std::make_shared<Node>(Node{std::move(document), "", root}));
  } catch (const toml::parse_error& error) {
    throw InputError(syntax_error(text, source, error));
  }
}

TomlTable TomlTable::read(const std::string& path, bool checked) {
  TomlTable file = parse(whole_file(path, kLargestToml_MB), path);
  file.node_->document->checked = checked;
  return file;
}

TomlTable TomlTable::read_kind(std::string_view kind, const std::string& path) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kTables{{{"machine", "links"},
                                                                                         {"device", "feel"},
                                                                                         {"scenario", "phase"},
                                                                                         {"link", "both"},
                                                                                         {"link", "to_machine"},
                                                                                         {"link", "to_operator"},
                                                                                         {"mapping", "channel"},
                                                                                         {"grid", "battery"}}};
  TomlTable file = read(path);
  std::string_view other;
  for (const auto& [of, table] : kTables) {
    if (!file.node_->table->contains(table)) continue;
    if (of == kind) return file;
    other = of;
  }
  if (other.empty()) return file;
  throw InputError(path + ": is a " + std::string(other) + " file, not a " + std::string(kind) + " file");
}

double TomlTable::number(std::string_view key, double min, double max, double factor) {
  const double instead = std::clamp(0.0, min, max) * factor;
  const toml::node* node = node_->get(key);
  if (node == nullptr) return instead;
  const auto value = as_number(*node);
  if (value && *value >= min && *value <= max) return *value * factor;
  node_->refuse(key, *node, (value ? "must be " : "must be a number ") + within(min, max));
  return instead;
}

std::int64_t TomlTable::integer(std::string_view key, std::int64_t min, std::int64_t max) {
  const std::int64_t instead = std::clamp(std::int64_t{0}, min, max);
  const toml::node* node = node_->get(key);
  if (node == nullptr) return instead;
  const auto* value = node->as_integer();
  if (value != nullptr && value->get() >= min && value->get() <= max) return value->get();
  using Limits = std::numeric_limits<std::int64_t>;
  const bool any = min == Limits::min() && max == Limits::max();
  node_->refuse(key, *node,
                any ? "must be a whole number"
                    : "must be a whole number within [" + std::to_string(min) + ", " + std::to_string(max) + "]");
  return instead;
}

bool TomlTable::boolean(std::string_view key) {
  const toml::node* node = node_->get(key);
  if (node != nullptr && node->is_boolean()) return node->as_boolean()->get();
  if (node != nullptr) node_->refuse(key, *node, "must be true or false");
  return false;
}

std::string TomlTable::text(std::string_view key) {
  const toml::node* node = node_->get(key);
  if (node == nullptr) return "";
  const std::string* value = node->is_string() ? &node->as_string()->get() : nullptr;
  if (value == nullptr || value->empty()) {
    node_->refuse(key, *node, "must be a text in quotes, not empty");
    return "";
  }
  if (value->size() > kLongestText || printable(*value) != *value) {
    node_->refuse(key, *node,
                  "must be at most " + std::to_string(kLongestText) + " characters, none of them a control character");
    return "";
  }
  return *value;
}

int TomlTable::choice(std::string_view key, std::span<const char* const> choices) {
  const toml::node* node = node_->get(key);
  std::string all;
  int index = 0;
  for (const char* one : choices) {
    if (node != nullptr && node->is_string() && node->as_string()->get() == one) return index;
    ++index;
    all += std::string(all.empty() ? "\"" : ", \"") + one + "\"";
  }
  if (node != nullptr) node_->refuse(key, *node, "must be one of " + all);
  return 0;
}

std::vector<double> TomlTable::list(std::string_view key, std::size_t min_count, std::size_t max_count, double min,
                                    double max, double factor) {
  const std::vector<double> instead(min_count, std::clamp(0.0, min, max) * factor);
  const toml::node* node = node_->get(key);
  if (node == nullptr) return instead;
  const std::string count = min_count == max_count ? std::to_string(min_count)
                                                   : std::to_string(min_count) + " to " + std::to_string(max_count);
  const auto refuse = [&] {
    node_->refuse(key, *node, "must be " + count + " numbers " + within(min, max));
    return instead;
  };
  const auto* array = node->as_array();
  if (array == nullptr || array->size() < min_count || array->size() > max_count) return refuse();
  std::vector<double> values;
  for (const toml::node& element : *array) {
    const auto value = as_number(element);
    if (!value || !(*value >= min && *value <= max)) return refuse();
    values.push_back(*value * factor);
  }
  return values;
}

TomlTable TomlTable::table(std::string_view key) {
  const toml::node* node = node_->get(key);
  if (node != nullptr && !node->is_table())
    node_->refuse(key, *node,
                  node_->path.find('[') == std::string::npos
                      ? "must be a table, [" + node_->path + std::string(key) + "]"
                      : "must be a table, { ... }");
  return node_->child(node != nullptr ? node->as_table() : nullptr, node_->path + std::string(key) + ".");
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) {
  std::vector<TomlTable> result;
  node_->asked.emplace(key);
  const toml::node* node = node_->table != nullptr ? node_->table->get(key) : nullptr;
  if (node == nullptr) return result;
  const auto* array = node->as_array();
  if (array == nullptr || !std::all_of(array->begin(), array->end(), [](const auto& one) { return one.is_table(); })) {
    node_->refuse(key, *node, "must be an array of tables, [[" + node_->path + std::string(key) + "]]");
    return result;
  }
  for (const toml::node& one : *array) {
    const std::string index = "[" + std::to_string(result.size()) + "].";
    result.push_back(node_->child(one.as_table(), node_->path + std::string(key) + index));
  }
  return result;
}

bool TomlTable::has(std::string_view key) const {
  node_->looked_for.emplace(key);
  return node_->table != nullptr && node_->table->contains(key);
}

bool TomlTable::is_array(std::string_view key) const {
  return has(key) && node_->table->get(key)->is_array();
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> all;
  if (node_->table == nullptr) return all;
  for (const auto& [key, value] : *node_->table) all.emplace_back(key.str());
  return all;
}

void TomlTable::leave(std::string_view key) {
  node_->asked.emplace(key);
}

void TomlTable::leave_rest() {
  node_->rest_left = true;
}

bool TomlTable::require(bool ok, std::string_view key, const std::string& bound, Keys others) const {
  if (ok || node_->table == nullptr || !sound({key}) || !sound(others)) return ok;
  if (const toml::node* value = node_->table->get(key)) {
    node_->refuse(key, *value, bound);
  } else {
    node_->note(*node_->table, key, ": " + bound);
  }
  return false;
}

bool TomlTable::sound(Keys keys) const {
  return std::all_of(keys.begin(), keys.end(), [this](std::string_view key) {
    const bool from_root = key.starts_with('.');
    return node_->document->sound(from_root ? std::string(key.substr(1)) : node_->path + std::string(key));
  });
}

void TomlTable::finish() const {
  node_->finish();
  if (!node_->document->errors.empty()) node_->document->refuse();
}

const std::string& TomlTable::source() const {
  return node_->document->source;
}
const std::string& TomlTable::document() const {
  return node_->document->text;
}

}  // namespace knuckle
