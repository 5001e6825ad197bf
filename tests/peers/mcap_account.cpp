// What our reader finds in an MCAP file, for comparison with what another does (mcap_account.cjs):
//   mcap_account FILE           prints the account
//   mcap_account --write FOLDER makes the files to be compared: plain.mcap, zstd.mcap, killed.mcap
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <random>
#include <string>

#include "recording/mcap/chunk.h"
#include "recording/mcap/file_writer.h"
#include "recording/mcap/reader.h"
#include "recording/mcap/records.h"

namespace {

using namespace knuckle::mcap;

void require(bool written) {
  if (written) return;
  std::cerr << "mcap_account: cannot write\n";
  std::exit(1);
}

void write(const std::string& path, Compression compression) {
  Topics topics;
  const auto schema = topics.add(Schema{"state", "jsonschema", "{}"});
  for (int i = 0; i < 5; ++i)
    topics.add(Channel{fmt::format("/channel/{}", i), "json", i < 4 ? schema : std::uint16_t{0}, {}});
  FileWriter writer;
  require(writer.open(path, topics));
  require(writer.attach({"machine.toml", "application/toml", 1, 2, "name = \"solar015\"\n"}));
  require(writer.note({"software", {{"version", "1"}, {"compiler", "g++"}}}));
  std::mt19937 random(1);
  ChunkBuilder builder;
  std::uint64_t at = 1'700'000'000'000'000'000;
  for (int chunk = 0; chunk < 10; ++chunk) {
    for (std::uint32_t i = 0; i < 300; ++i) {
      // Not always in the order of time.
      at += random() % 2'000'000;
      std::string data(random() % 800, 'x');
      for (char& c : data) c = static_cast<char>('a' + random() % 5);
      builder.add(static_cast<std::uint16_t>(1 + random() % 5), i, at - random() % 10'000'000, at,
                  {reinterpret_cast<const std::uint8_t*>(data.data()), data.size()});
    }
    require(writer.append(builder.finish(compression)));
  }
  require(writer.note({"bookmark", {{"text", "slipped"}}}));
  if (path.ends_with("plain.mcap"))  // before it has its end, as a killed program leaves it
    std::filesystem::copy_file(path, std::filesystem::path(path).replace_filename("killed.mcap"));
  require(writer.close());
}

struct Account {
  std::uint64_t messages = 0, first_ns = ~0ull, last_ns = 0;
  std::uint32_t sum = 0;  ///< Of the messages' CRC-32, whatever their order.
};

void print(const std::string& path) {
  Reader reader(path);
  std::map<std::string, Account> accounts;
  while (const auto message = reader.next()) {
    Account& account = accounts[reader.topics().channels.at(message->channel_id).topic];
    ++account.messages;
    account.first_ns = std::min(account.first_ns, message->log_time_ns);
    account.last_ns = std::max(account.last_ns, message->log_time_ns);
    account.sum += crc32(message->data);
  }
  for (const auto& [topic, account] : accounts)
    std::cout << fmt::format("{} {} messages, {} to {} ns, sum {:08x}\n", topic, account.messages, account.first_ns,
                             account.last_ns, account.sum);
  for (const AttachmentEntry& entry : reader.attachments()) {
    const auto attachment = reader.read(entry);
    std::cout << "attachment " << entry.name << ": " << (attachment ? attachment->data : "damaged\n");
  }
  for (const Metadata& metadata : reader.metadata()) {
    std::cout << "metadata " << metadata.name;
    for (const auto& [key, value] : metadata.values) std::cout << " " << key << "=" << value;
    std::cout << "\n";
  }
  for (const std::string& line : reader.damages()) std::cout << line << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "--write") {
    write(argv[2] + std::string("/plain.mcap"), {});
    write(argv[2] + std::string("/zstd.mcap"), {.zstd_level = 1});
  } else if (argc == 2) {
    print(argv[1]);
  } else {
    std::cerr << "usage: mcap_account FILE | --write FOLDER\n";
    return 2;
  }
}
