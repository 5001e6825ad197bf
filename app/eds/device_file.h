// A vendor's device file (EDS, CiA 306): which objects a CANopen device has, who may write them, what they hold as
// delivered. Slips that files in the field have are read and told; what cannot be understood is refused.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/can_nodes.h"
#include "transport/canopen.h"
#include "transport/signal_codec.h"

namespace knuckle::eds {

enum class Access : std::uint8_t { kReadOnly, kWriteOnly, kReadWrite };

/// A number that may depend on the node id: "$NODEID+0x180".
struct Value {
  std::int64_t number = 0;
  bool plus_node_id = false;
  /// @return its 32 bits.
  [[nodiscard]] std::uint32_t of(std::uint8_t node) const noexcept {
    return static_cast<std::uint32_t>(number + (plus_node_id ? node : 0));
  }
};

/// Numbers of fixed length (CiA 301).
struct DataType {
  std::uint16_t number;
  std::uint8_t bytes;
  BitField::Type type;
  const char* name;
};
inline constexpr std::array kDataTypes{
    DataType{1, 1, BitField::Type::kUnsigned, "BOOLEAN"},    DataType{2, 1, BitField::Type::kSigned, "INTEGER8"},
    DataType{3, 2, BitField::Type::kSigned, "INTEGER16"},    DataType{4, 4, BitField::Type::kSigned, "INTEGER32"},
    DataType{5, 1, BitField::Type::kUnsigned, "UNSIGNED8"},  DataType{6, 2, BitField::Type::kUnsigned, "UNSIGNED16"},
    DataType{7, 4, BitField::Type::kUnsigned, "UNSIGNED32"}, DataType{8, 4, BitField::Type::kFloat, "REAL32"}};
/// What these bits of a signed number of 1 to 4 bytes are.
[[nodiscard]] std::int64_t signed_value(std::uint32_t bits, unsigned bytes) noexcept;
/// nullptr where it is none of these.
[[nodiscard]] const DataType* data_type(std::uint16_t number) noexcept;

/// One object, or one sub-index of it.
struct Entry {
  std::string name;
  std::uint16_t data_type = 0;  ///< CiA 301, a number of kDataTypes where Knuckle knows it.
  Access access = Access::kReadOnly;
  std::optional<Value> value;    ///< As delivered; nothing where the file gives none, or one that is no whole number.
  std::optional<bool> mappable;  ///< Into process data; nothing where the file does not say it.
  std::optional<std::int64_t> lowest, most;  ///< LowLimit, HighLimit.
  int line = 0, type_line = 0;               ///< Where its section begins, and says the data type.
  [[nodiscard]] bool may_be_written() const noexcept { return access != Access::kReadOnly; }
};

/// "0x1018:01 (vendor id)", with the name that its entry has.
[[nodiscard]] std::string object_text(canopen::Object object, const Entry* entry = nullptr);
/// @param key as of DeviceFile::entries. @return whether it says what a PDO has in one place.
[[nodiscard]] constexpr bool is_mapping(std::uint32_t key) noexcept {
  const std::uint32_t index = key >> 8;
  return (key & 0xFF) != 0 && ((index >= 0x1600 && index < 0x1800) || (index >= 0x1A00 && index < 0x1C00));
}

struct DeviceFile {
  std::string source;  ///< The file's name.
  std::string vendor_name, product_name;
  std::uint32_t device_type = 0, vendor = 0, product = 0;
  std::vector<int> bit_rates_kbps;  ///< Empty where the file says nothing of them.
  bool lss = false;                 ///< Its node id can be set over the bus by CiA 305.
  std::vector<std::string> slips;   ///< What the file says in a way that it should not: "line 12: ...".

  [[nodiscard]] const Entry* find(canopen::Object object) const noexcept;
  /// By index << 8 | sub-index.
  std::map<std::uint32_t, Entry> entries;
};

/// @throws InputError, one line with file, line and key, where it is no device file or its identity is missing.
[[nodiscard]] DeviceFile parse_device_file(std::string_view text, const std::string& source);
[[nodiscard]] DeviceFile read_device_file(const std::string& path);

/// The device with this node id as a simulated node has it: `node.become(dictionary(file, id))`. Objects that are no
/// number of 1, 2 or 4 bytes are left out; a value that the file does not give is 0.
[[nodiscard]] std::vector<sim::DeviceObject> dictionary(const DeviceFile& device, std::uint8_t node);

}  // namespace knuckle::eds
