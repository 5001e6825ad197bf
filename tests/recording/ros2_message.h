// Any ROS 2 message by the text of its schema alone, as other programs read it.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording/cdr.h"

namespace knuckle::test {

/// What a schema says: for each message within, in their order, the fields.
class Ros2Schema {
 public:
  struct Field {
    std::string type, name;
    int fixed = 0;          ///< Length of a fixed array.
    bool sequence = false;  ///< Of any length.
  };

  explicit Ros2Schema(const std::string& text) {
    std::istringstream lines(text);
    std::string message;
    messages_[message];
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line.substr(0, line.find('#')));
      std::string first, second;
      if (!(words >> first >> second)) continue;  // a comment, or between two messages
      if (first == "MSG:") {
        message = second;
        if (!messages_.try_emplace(message).second) throw std::runtime_error(message + " is defined twice");
      } else if (second.find('=') == std::string::npos) {
        const std::size_t bracket = first.find('[');
        const std::string size = bracket == std::string::npos ? "" : first.substr(bracket + 1);
        messages_[message].push_back(
            {first.substr(0, bracket), second, size.size() > 1 ? std::stoi(size) : 0, size == "]"});
      }
    }
    for (auto& [name, fields] : messages_) {
      for (Field& field : fields) field.type = resolved(field.type);
    }
  }

  [[nodiscard]] const std::map<std::string, std::vector<Field>>& messages() const { return messages_; }
  /// @throws std::out_of_range where it is not defined.
  [[nodiscard]] const std::vector<Field>& fields(const std::string& message) const { return messages_.at(message); }

 private:
  /// A message may be named without its package.
  [[nodiscard]] std::string resolved(const std::string& type) const {
    for (const auto& [name, fields] : messages_) {
      if (name.ends_with("/" + type)) return name;
    }
    return type;
  }

  std::map<std::string, std::vector<Field>> messages_;  // that of the schema itself has an empty name
};

/// A message's numbers and texts by their paths: "entities[0].arrows[1].pose.position.x". Of a sequence, its length
/// stands at its own path.
class Ros2Message {
 public:
  /// @throws std::runtime_error where the message does not end with its last field.
  Ros2Message(const Ros2Schema& schema, std::span<const std::uint8_t> bytes) : schema_(schema), in_(bytes) {
    read_fields("", "");
    if (!in_.ok()) throw std::runtime_error("the message ends before its last field");
    if (in_.at() != bytes.size()) throw std::runtime_error("the message goes on behind its last field");
  }

  [[nodiscard]] double number(const std::string& path) const { return numbers_.at(path); }
  [[nodiscard]] const std::string& text(const std::string& path) const { return texts_.at(path); }
  [[nodiscard]] int size(const std::string& path) const { return static_cast<int>(numbers_.at(path)); }
  [[nodiscard]] double seconds(const std::string& path) const {
    return number(path + ".sec") + 1e-9 * number(path + ".nanosec");
  }

 private:
  void read_fields(const std::string& message, const std::string& prefix) {
    for (const Ros2Schema::Field& field : schema_.fields(message)) {
      const std::string path = prefix + field.name;
      const int size = field.sequence ? static_cast<int>(in_.get<std::uint32_t>()) : field.fixed;
      if (!in_.ok() || size > 100'000) throw std::runtime_error(path + ": the message ends before its last field");
      if (size > 0 || field.sequence) numbers_[path] = size;
      if (size == 0 && !field.sequence) read(field.type, path);
      for (int i = 0; i < size; ++i) read(field.type, path + "[" + std::to_string(i) + "]");
    }
  }

  void read(const std::string& type, const std::string& path) {
    if (type == "string") {
      texts_[path] = in_.get_text();
    } else if (type == "float64") {
      numbers_[path] = in_.get<double>();
    } else if (type == "float32") {
      numbers_[path] = in_.get<float>();
    } else if (type == "uint8" || type == "bool") {
      numbers_[path] = in_.get<std::uint8_t>();
    } else if (type == "uint16") {
      numbers_[path] = in_.get<std::uint16_t>();
    } else if (type == "uint32") {
      numbers_[path] = in_.get<std::uint32_t>();
    } else if (type == "int32") {
      numbers_[path] = in_.get<std::int32_t>();
    } else if (type == "uint64") {
      numbers_[path] = static_cast<double>(in_.get<std::uint64_t>());
    } else if (type == "int64") {
      numbers_[path] = static_cast<double>(in_.get<std::int64_t>());
    } else {
      read_fields(type, path + ".");
    }
  }

  const Ros2Schema& schema_;
  recording::CdrReader in_;
  std::map<std::string, double> numbers_;
  std::map<std::string, std::string> texts_;
};

}  // namespace knuckle::test
