#include "app/eds/device_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>

#include "app/recordings/csv_cells.h"
#include "core/error.h"
#include "core/text.h"
#include "machine/file_text.h"

namespace knuckle::eds {
namespace {

constexpr std::size_t kLargest_MB = 4;
constexpr std::uint32_t kMostSubindex = 254;
constexpr std::uint16_t kUnsigned8 = 5;

std::string lower(std::string_view text) {
  std::string low(text);
  std::transform(low.begin(), low.end(), low.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  return low;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// Whole, decimal or 0x...; nothing else. A leading zero is octal for some and decimal for others: not a number here.
std::optional<std::int64_t> whole_number(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  if (hex) text.remove_prefix(2);
  if (text.empty() || (!hex && text.size() > 1 && text[0] == '0')) return std::nullopt;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
  if (error != std::errc() || end != text.data() + text.size() || value > 0xFFFFFFFF) return std::nullopt;
  return negative ? -static_cast<std::int64_t>(value) : static_cast<std::int64_t>(value);
}

/// "0x180", "$NODEID+0x180", "0x180 + $NodeId", "$NODEID".
std::optional<Value> value_of(std::string_view text) {
  const std::string low = lower(text);
  const std::string_view all = low;
  const auto plus = all.find('+');
  const std::string_view first = trimmed(all.substr(0, plus));
  const std::string_view second = plus == std::string_view::npos ? "0" : trimmed(all.substr(plus + 1));
  const bool first_is_id = first == "$nodeid", plus_node_id = first_is_id || second == "$nodeid";
  if (plus != std::string_view::npos && !plus_node_id) return std::nullopt;
  const auto number = whole_number(plus_node_id && first_is_id ? second : first);
  return number ? std::optional<Value>({*number, plus_node_id}) : std::nullopt;
}

std::optional<Access> access_of(const std::string& text) {
  const std::string access = lower(text);
  if (access == "ro" || access == "const") return Access::kReadOnly;
  if (access == "wo") return Access::kWriteOnly;
  if (access == "rw" || access == "rwr" || access == "rww") return Access::kReadWrite;
  return std::nullopt;
}

struct Key {
  std::string value;
  int line = 0;
};
/// "1018", "1018sub1".
bool object_name(const std::string& name) {
  return name.size() >= 4 && name.find_first_not_of("0123456789abcdef") >= 4 &&
         (name.size() == 4 || name.compare(4, 3, "sub") == 0);
}

/// Of a section, in small letters: what no other kind of text has.
bool of_eds(const std::string& name) {
  return object_name(name) || name == "deviceinfo" || name == "fileinfo";
}

struct Section {
  std::string name;  ///< As written.
  int line = 0;
  std::map<std::string, Key> keys;  ///< By their names in small letters.
  [[nodiscard]] const Key* find(const std::string& key) const {
    const auto at = keys.find(key);
    return at == keys.end() || at->second.value.empty() ? nullptr : &at->second;
  }
};

std::uint32_t key_of(canopen::Object object) {
  return std::uint32_t{object.index} << 8 | object.subindex;
}
canopen::Object object_of(std::uint32_t key) {
  return {static_cast<std::uint16_t>(key >> 8), static_cast<std::uint8_t>(key & 0xFF)};
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& source) {
    file_.source = source;
    split(recordings::to_utf8(std::string(text)).utf8, source);
  }

  DeviceFile read() {
    for (const auto& [name, section] : sections_) object(section);
    check_end();
    listed();
    mapped();
    device_info();
    identity();
    std::stable_sort(slips_.begin(), slips_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [line, what] : slips_) file_.slips.push_back(fmt::format("line {}: {}", line, what));
    return std::move(file_);
  }

 private:
  /// By its name in small letters; nullptr where it is not there.
  [[nodiscard]] const Section* find(const std::string& section) const {
    const auto at = sections_.find(section);
    return at == sections_.end() ? nullptr : &at->second;
  }
  [[nodiscard]] const Key* find(const std::string& section, const std::string& key) const {
    const Section* const there = find(section);
    return there == nullptr ? nullptr : there->find(key);
  }

  void slip(int line, std::string what) { slips_.emplace_back(line, std::move(what)); }
  [[noreturn]] void refuse(int line, const std::string& key, const std::string& why) const {
    throw InputError(fmt::format("{}: line {}: {}: {}", file_.source, line, key, why));
  }
  /// Start-up uses no object of the vendor's own (CiA 301: 0x2000 to 0x5FFF): a damaged one stops nobody.
  void damaged(std::uint32_t index, int line, const std::string& key, const std::string& why) {
    if (index < 0x2000 || index > 0x5FFF) refuse(line, key, why);
    slip(line, key + ": " + why + ": passed over");
    damaged_.insert(index);
  }

  void split(std::string_view text, const std::string& source) {
    if (text.find('\0') != std::string_view::npos)
      throw InputError(source + ": is not an EDS file: it has bytes that no text has");
    Section* open = nullptr;
    std::string first;                                  // line that says something
    if (text.ends_with('\x1a')) text.remove_suffix(1);  // where a file of DOS ends
    cut_ = !text.empty() && text.back() != '\n';
    for (int number = 1; !text.empty(); ++number) {
      const auto end = text.find('\n');
      const std::string_view line = trimmed(text.substr(0, end));
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      if (line.empty() || line[0] == ';' || line[0] == '#') continue;
      if (first.empty()) first = fmt::format("line {}: '{}': ", number, shortened(line));
      if (line[0] == '[') {
        open = section(line, number);
      } else if (const auto equals = line.find('='); equals != std::string_view::npos && open != nullptr) {
        const std::string key = printable(trimmed(line.substr(0, equals)));
        const auto [at, is_new] =
            open->keys.try_emplace(lower(key), Key{printable(trimmed(line.substr(equals + 1))), number});
        if (!is_new) slip(number, fmt::format("{} stands twice in [{}]: the first is taken", key, open->name));
      } else if (cut_ && text.empty()) {
        refuse(number, printable(line.substr(0, 40)), "the file ends in the middle of this line");
      } else {
        slip(number, "is neither a section nor a key: passed over");
      }
    }
    if (std::none_of(sections_.begin(), sections_.end(), [](const auto& one) { return of_eds(one.first); }))
      throw InputError(source + ": " + first + "is not an EDS file: it has no section of an object, such as [1000]");
  }

  Section* section(std::string_view line, int number) {
    const auto close = line.find(']');
    if (close == std::string_view::npos) refuse(number, printable(line.substr(0, 40)), "has no closing bracket");
    const std::string name = printable(trimmed(line.substr(1, close - 1)));
    const auto [at, is_new] = sections_.try_emplace(lower(name), Section{name, number, {}});
    if (!is_new) slip(number, fmt::format("[{}] stands twice: read as one", name));
    return &at->second;
  }

  /// [1018], [1018sub1]; other sections are none of an object.
  void object(const Section& section) {
    const std::string name = lower(section.name);
    if (!object_name(name)) return;
    std::uint32_t index = 0, sub = 0;
    std::from_chars(name.data(), name.data() + 4, index, 16);
    const std::string_view rest = std::string_view(name).substr(4);
    if (!rest.empty()) {
      const auto [end, error] = std::from_chars(rest.data() + 3, rest.data() + rest.size(), sub, 16);
      if (error != std::errc() || end != rest.data() + rest.size() || sub > kMostSubindex)
        return slip(section.line, fmt::format("[{}] is no object's name: passed over", section.name));
    }
    if (const Key* compact = section.find("compactsubobj")) {
      this->compact(section, index, *compact);
    } else if (section.find("datatype") != nullptr) {
      if (const auto one = entry(section, index)) file_.entries[index << 8 | sub] = *one;
    } else if (section.find("subnumber") == nullptr) {
      slip(section.line, fmt::format("[{}] has no DataType: passed over", section.name));
    }
  }

  /// nullopt where it is damaged().
  std::optional<Entry> entry(const Section& section, std::uint32_t index) {
    Entry entry;
    entry.line = section.line;
    if (const Key* name = section.find("parametername")) entry.name = name->value;
    const Key* type = section.find("datatype");
    const auto number = type != nullptr ? whole_number(type->value) : std::nullopt;
    if (!number || *number < 1 || *number > 0xFFFF) {
      damaged(index, type != nullptr ? type->line : section.line, "DataType of [" + section.name + "]",
              "must be a number of CiA 301");
      return std::nullopt;
    }
    entry.data_type = static_cast<std::uint16_t>(*number);
    entry.type_line = type->line;
    if (const Key* access = section.find("accesstype")) {
      const auto known = access_of(access->value);
      if (!known) {
        damaged(index, access->line, "AccessType of [" + section.name + "]", "must be ro, wo, rw, rwr, rww or const");
        return std::nullopt;
      }
      entry.access = *known;
    } else {
      slip(section.line, fmt::format("[{}] has no AccessType: taken as read-only", section.name));
    }
    if (const Key* mapping = section.find("pdomapping")) entry.mappable = whole_number(mapping->value).value_or(0) != 0;
    if (const DataType* known = data_type(entry.data_type); known != nullptr && known->type != BitField::Type::kFloat) {
      entry.lowest = limit(section.find("lowlimit"), *known);
      entry.most = limit(section.find("highlimit"), *known);
    }
    if (const Key* value = section.find("defaultvalue")) entry.value = default_of(section, *value, entry.data_type);
    return entry;
  }

  /// Of a signed object it may be given by its bits.
  static std::optional<std::int64_t> limit(const Key* key, const DataType& type) {
    const auto number = key != nullptr ? whole_number(key->value) : std::nullopt;
    if (!number || type.type != BitField::Type::kSigned) return number;
    return signed_value(static_cast<std::uint32_t>(*number), type.bytes);
  }

  std::optional<Value> default_of(const Section& section, const Key& key, std::uint16_t data_type) {
    const DataType* const type = eds::data_type(data_type);
    const bool whole = type != nullptr && type->type != BitField::Type::kFloat;
    const auto value = value_of(key.value);
    if (whole && !value)
      slip(key.line, fmt::format("DefaultValue of [{}] is not a number that can be read: not known", section.name));
    return whole ? value : std::nullopt;
  }

  /// CompactSubObj = n: sub-indices 1...n are alike; [....Value] and [....Name] say where they differ.
  void compact(const Section& section, std::uint32_t index, const Key& key) {
    const auto count = whole_number(key.value);
    if (!count || *count < 0 || *count > kMostSubindex)
      return damaged(index, key.line, "CompactSubObj of [" + section.name + "]", "must be within [0, 254]");
    const auto all = entry(section, index);
    if (!all) return;
    Entry& number = file_.entries[index << 8] = *all;
    number.name = "number of entries";
    number.data_type = kUnsigned8;
    number.access = Access::kReadOnly;
    number.value = Value{*count, false};
    number.mappable = false;
    const std::string values = lower(section.name) + "value", names = lower(section.name) + "name";
    for (std::uint32_t sub = 1; sub <= *count; ++sub) {
      Entry& one = file_.entries[index << 8 | sub] = *all;
      const std::string at = std::to_string(sub);
      if (const Key* own = find(values, at)) one.value = default_of(*find(values), *own, one.data_type);
      if (const Key* own = find(names, at)) one.name = own->value;
    }
  }

  /// The last section of a file that was cut off lacks what every object has.
  void check_end() const {
    const auto last = std::max_element(sections_.begin(), sections_.end(),
                                       [](const auto& a, const auto& b) { return a.second.line < b.second.line; });
    const Section& section = last->second;
    const bool whole = section.find("subnumber") != nullptr ||
                       (section.find("datatype") != nullptr && section.find("accesstype") != nullptr);
    if (object_name(last->first) && !whole)
      refuse(section.line, "[" + section.name + "]", "the file ends in it, before its DataType and AccessType");
  }

  /// [MandatoryObjects], [OptionalObjects] and [ManufacturerObjects] against the sections that are there.
  void listed() {
    std::set<std::uint32_t> present = damaged_, listed;
    for (const auto& [key, entry] : file_.entries) present.insert(key >> 8);
    int lists = 0;
    for (const char* name : {"mandatoryobjects", "optionalobjects", "manufacturerobjects"}) {
      const Section* const list = find(name);
      if (list == nullptr) continue;
      ++lists;
      std::int64_t entries = 0;
      for (const auto& [key, value] : list->keys) {
        if (key == "supportedobjects") continue;
        ++entries;
        const auto index = whole_number(value.value);
        const bool missing = !index || !present.contains(static_cast<std::uint32_t>(*index));
        if (missing && (cut_ || std::string_view(name) == "mandatoryobjects"))
          refuse(value.line, fmt::format("[{}] lists '{}'", list->name, value.value),
                 "has no section: is the file complete?");
        if (missing)
          slip(value.line, fmt::format("[{}] lists '{}', which has no section", list->name, value.value));
        else
          listed.insert(static_cast<std::uint32_t>(*index));
      }
      const Key* count = list->find("supportedobjects");
      if (count != nullptr && whole_number(count->value) != entries)
        slip(count->line, fmt::format("[{}] says {} objects and lists {}", list->name, count->value, entries));
    }
    if (lists == 0) return slip(1, "no list of objects: all sections are taken");
    for (const auto& [key, entry] : file_.entries)
      if ((key & 0xFF) == 0 && !listed.contains(key >> 8))
        slip(entry.line, fmt::format("0x{:04X} has a section, but no list names it: taken", key >> 8));
  }

  /// What process data map as delivered must be there; those who do not want such a PDO are not stopped by it.
  void mapped() {
    for (const auto& [key, entry] : file_.entries) {
      if (!is_mapping(key) || !entry.value || entry.value->number == 0) continue;
      const auto target = static_cast<std::uint32_t>(entry.value->number) >> 8;
      const bool dummy = target >> 8 >= 1 && target >> 8 <= 7;  // bytes to skip
      if (!dummy && !file_.entries.contains(target))
        slip(entry.line, fmt::format("{} maps {}, which the file does not have", object_text(object_of(key)),
                                     object_text(object_of(target))));
    }
  }

  void device_info() {
    const Section* const info = find("deviceinfo");
    if (info == nullptr) return slip(1, "no [DeviceInfo]: bit rates and LSS are not known");
    for (const auto& [key, value] : info->keys) {
      if (!key.starts_with("baudrate_") || whole_number(value.value).value_or(0) == 0) continue;
      if (const auto kbps = whole_number(std::string_view(key).substr(9)); kbps && *kbps > 0 && *kbps <= 1000)
        file_.bit_rates_kbps.push_back(static_cast<int>(*kbps));
    }
    std::sort(file_.bit_rates_kbps.begin(), file_.bit_rates_kbps.end());
    if (const Key* name = info->find("vendorname")) file_.vendor_name = name->value;
    if (const Key* name = info->find("productname")) file_.product_name = name->value;
    if (const Key* lss = info->find("lss_supported")) file_.lss = whole_number(lss->value).value_or(0) != 0;
  }

  void identity() {
    file_.device_type = identity(canopen::kDeviceType, "");
    file_.vendor = identity(canopen::kVendorId, "VendorNumber");
    file_.product = identity(canopen::kProductCode, "ProductNumber");
    if (file_.vendor == 0)
      slip(1,
           "vendor id 0 (0x1018:01) is nobody's: written as it is, and 'profile' as of any vendor; correct both where "
           "knuckle doctor reads another");
  }

  /// From the object that start-up reads; [DeviceInfo] may say it once more.
  std::uint32_t identity(canopen::Object object, const std::string& info_key) {
    const Entry* const entry = file_.find(object);
    const auto value = entry != nullptr ? entry->value : std::nullopt;
    const Key* const key = info_key.empty() ? nullptr : find("deviceinfo", lower(info_key));
    const auto told = key != nullptr ? whole_number(key->value) : std::nullopt;
    const std::string name = object_text(object), of_object = "DefaultValue of " + name;
    const char* const bound = "must be a whole number from 0 to 0xFFFFFFFF";
    if (value && value->number < 0) refuse(entry->line, of_object, bound);
    if (value && told && value->number != 0 && value->of(0) != static_cast<std::uint32_t>(*told))
      slip(key->line, fmt::format("{} is 0x{:X}, and 0x{:X} in {}: the object's is taken", info_key,
                                  static_cast<std::uint32_t>(*told), value->of(0), name));
    if (value && (value->number != 0 || !told)) return value->of(0);
    if (told) return static_cast<std::uint32_t>(*told);
    if (key != nullptr) refuse(key->line, info_key + " of [DeviceInfo]", bound);
    if (entry != nullptr) refuse(entry->line, of_object, "is missing: who this device is, is not known");
    throw InputError(file_.source + ": " + name + " has no value: who this device is, is not known");
  }

  DeviceFile file_;
  std::map<std::string, Section> sections_;  // by their names in small letters
  std::vector<std::pair<int, std::string>> slips_;
  std::set<std::uint32_t> damaged_;  // indices that have a section nobody can read
  bool cut_ = false;                 // the last line has no end
};

}  // namespace

std::string object_text(canopen::Object object, const Entry* entry) {
  const std::string name = entry != nullptr && !entry->name.empty() ? " (" + entry->name + ")" : "";
  return fmt::format("0x{:04X}:{:02X}{}", object.index, object.subindex, name);
}

std::int64_t signed_value(std::uint32_t bits, unsigned bytes) noexcept {
  const unsigned unused = 32 - 8 * bytes;
  return static_cast<std::int32_t>(bits << unused) >> unused;
}

const DataType* data_type(std::uint16_t number) noexcept {
  const auto known = std::find_if(kDataTypes.begin(), kDataTypes.end(),
                                  [number](const DataType& one) { return one.number == number; });
  return known == kDataTypes.end() ? nullptr : &*known;
}

const Entry* DeviceFile::find(canopen::Object object) const noexcept {
  const auto at = entries.find(key_of(object));
  return at == entries.end() ? nullptr : &at->second;
}

DeviceFile parse_device_file(std::string_view text, const std::string& source) {
  return Reader(text, source).read();
}

DeviceFile read_device_file(const std::string& path) {
  return parse_device_file(whole_file(path, kLargest_MB), path);
}

std::vector<sim::DeviceObject> dictionary(const DeviceFile& device, std::uint8_t node) {
  std::vector<sim::DeviceObject> objects;
  for (const auto& [key, entry] : device.entries) {
    const DataType* const type = data_type(entry.data_type);
    if (type == nullptr) continue;
    objects.push_back({object_of(key), type->bytes,
                       entry.may_be_written() ? sim::Access::kReadWrite : sim::Access::kReadOnly,
                       entry.value ? entry.value->of(node) : 0});
  }
  return objects;
}

}  // namespace knuckle::eds
