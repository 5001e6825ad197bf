// Strict reading of Knuckle's TOML files: every key is asked for, bounded and converted to SI in one call, and whatever
// nobody asked for is an error. Used for machine, device, scenario, truth and mapping files.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/units.h"

namespace knuckle {

inline constexpr std::size_t kLargestToml_MB = 1;  ///< A calibrated machine file has 0.02.

/// All that one reading of a file has found wrong. what() is the first found, and how many there are.
class FileErrors : public InputError {
 public:
  /// @param hint after the number of errors: "; knuckle check shows all".
  FileErrors(const std::string& first, std::vector<std::string> lines, const std::string& hint);
  /// In the order of the file.
  [[nodiscard]] const std::vector<std::string>& lines() const noexcept { return lines_; }

 private:
  std::vector<std::string> lines_;
};

/// One table of a TOML file; a cheap handle on the document, which lives as long as a handle does.
///
/// A key that is missing, of another type, not finite or out of bounds is noted in one line, such as
/// `solar015.toml:95: key 'hydraulics.main_relief_bar' = 900: must be within [50, 400]`,
/// and the getter returns a value within the bounds, so that reading goes on and finds what else is wrong. So finish()
/// must be called on the root before anything read is used: it throws what was noted. Bounds are inclusive and in the
/// file's unit; the result is value * factor.
class TomlTable {
 public:
  /// @throws InputError where the file cannot be read, is larger than kLargestToml_MB, nests its tables or values
  /// deeper than 16, or is not TOML.
  /// @param checked messages name `knuckle check`, which reads such files.
  [[nodiscard]] static TomlTable read(const std::string& path, bool checked = true);
  /// @param kind "machine", "device", "scenario", "link", "mapping", "grid" or "truth". @throws InputError also where
  /// the file is of another kind, by tables that only one kind has.
  [[nodiscard]] static TomlTable read_kind(std::string_view kind, const std::string& path);
  /// The same for text in memory; `source` names it in messages.
  [[nodiscard]] static TomlTable parse(std::string_view text, const std::string& source);

  [[nodiscard]] double number(std::string_view key, double min, double max, double factor = 1);
  /// Without bounds where what is right is no range: whoever reads it says what is.
  [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t min = std::numeric_limits<std::int64_t>::min(),
                                     std::int64_t max = std::numeric_limits<std::int64_t>::max());
  [[nodiscard]] bool boolean(std::string_view key);
  /// A string of 1 to 1000 characters, none of them a control character: it may be printed and written anywhere. Empty
  /// where that was noted.
  [[nodiscard]] std::string text(std::string_view key);
  /// Index of the string's value among `choices`; 0 where something was noted.
  [[nodiscard]] int choice(std::string_view key, std::span<const char* const> choices);
  [[nodiscard]] int choice(std::string_view key, std::initializer_list<const char*> choices) {
    return choice(key, std::span(choices.begin(), choices.size()));
  }
  /// An array of min_count...max_count numbers, each within [min, max].
  [[nodiscard]] std::vector<double> list(std::string_view key, std::size_t min_count, std::size_t max_count, double min,
                                         double max, double factor = 1);
  /// An array of exactly N numbers.
  template <int N>
  [[nodiscard]] Eigen::Matrix<double, N, 1> numbers(std::string_view key, double min, double max, double factor = 1) {
    return Eigen::Map<const Eigen::Matrix<double, N, 1>>(list(key, N, N, min, max, factor).data());
  }
  [[nodiscard]] TomlTable table(std::string_view key);
  /// An array of tables; empty where the key is absent or that was noted.
  [[nodiscard]] std::vector<TomlTable> tables(std::string_view key);
  /// Whether it is there, and an array. Does not count as asking for its value.
  [[nodiscard]] bool is_array(std::string_view key) const;

  /// For optional keys: whether it is there. Does not count as asking for its value.
  [[nodiscard]] bool has(std::string_view key) const;
  /// Names of all that is in this table, sorted. Does not count as asking for it.
  [[nodiscard]] std::vector<std::string> keys() const;
  /// For what others keep in the file: whether it is there and what is in it does not matter.
  void leave(std::string_view key);
  /// Where the key that decides which others belong here was noted: whatever else is here does not matter.
  void leave_rest();
  /// Names of keys in the same table, or from the root where they begin with a dot: ".links.boom.min_rad".
  using Keys = std::initializer_list<std::string_view>;
  /// A check between keys: notes the usual line with `key`, its value and `bound` unless `ok`. Says nothing where
  /// `key`, or one of the `others` that the check looked at, was noted before: it is not known, then, what is right.
  /// @return ok
  bool require(bool ok, std::string_view key, const std::string& bound, Keys others = {}) const;
  /// Whether nothing was noted of these keys and of what is in them.
  [[nodiscard]] bool sound(Keys keys) const;
  /// Notes every key, here and in the tables handed out, that no getter asked for, with the nearest one that was.
  /// @throws FileErrors where anything was noted.
  void finish() const;

  [[nodiscard]] const std::string& source() const;
  /// The whole document, as it was read.
  [[nodiscard]] const std::string& document() const;

 private:
  struct Document;
  struct Node;
  explicit TomlTable(std::shared_ptr<Node> node);
  std::shared_ptr<Node> node_;
};

/// The digits of a number as TOML writes one that is not whole by its type: "17.0" for "17".
[[nodiscard]] std::string with_point(std::string digits);
/// "90", "0.25": a number for messages, to nine digits, without the dust of unit conversions.
[[nodiscard]] std::string number_text(double value);

}  // namespace knuckle
