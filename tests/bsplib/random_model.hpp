#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <vector>

/// A sequential model of BSPlib: all processes in one address space, written for clarity, and independent of
/// the layer.
///
/// Memory is named by process and block. A registration holds for every process a block (or none: NULL) and a
/// size. The rules are those of the paper of 1998, and where that leaves the order open, those that bsp.h
/// promises.
namespace random_model {

constexpr int no_block = -1;
using Bytes = std::vector<unsigned char>;

struct Registration {
  std::vector<int> block;         ///< by process
  std::vector<std::size_t> size;  ///< by process
};

struct Message {
  Bytes tag, payload;
};

class Model {
 public:
  Model(int processes, const std::vector<std::size_t>& block_sizes)
      : memory_(static_cast<std::size_t>(processes)) {
    for (auto& blocks : memory_)
      for (const std::size_t size : block_sizes) blocks.emplace_back(size);
    inbox_.resize(memory_.size());
    outbox_.resize(memory_.size());
  }

  int processes() const { return static_cast<int>(memory_.size()); }
  Bytes& block(int process, int b) { return memory_[at(process)][at(b)]; }
  const std::vector<Message>& inbox(int process) const { return inbox_[at(process)]; }
  std::size_t tag_size() const { return tag_size_; }

  /// The newest registration in effect that a process knows by a block; null if there is none.
  const Registration* find(int process, int b) const {
    for (auto r = effective_.rbegin(); r != effective_.rend(); ++r)
      if (r->block[at(process)] == b) return &*r;
    return nullptr;
  }
  /// Registrations as they will be after the next sync.
  const std::vector<Registration>& upcoming() const { return upcoming_; }

  void push(Registration registration) { upcoming_.push_back(std::move(registration)); }
  /// Removes the newest registration that process 0 knows by a block.
  void pop(int b) {
    for (auto r = upcoming_.rbegin(); r != upcoming_.rend(); ++r)
      if (r->block[0] == b) {
        upcoming_.erase(std::next(r).base());
        return;
      }
  }

  void put(int from, int to, int known_as, std::size_t offset, Bytes data) {
    puts_.push_back({from, to, find(from, known_as)->block[at(to)], offset, std::move(data)});
  }
  void get(int by, int from, int known_as, std::size_t offset, int target, std::size_t target_offset,
           std::size_t size) {
    gets_.push_back({by, from, find(by, known_as)->block[at(from)], offset, target, target_offset, size, {}});
  }
  void send(int from, int to, Message message) { outbox_[at(to)][from].push_back(std::move(message)); }
  void set_tag_size(std::size_t size) { next_tag_size_ = size; }

  void sync() {
    for (Get& get : gets_) {
      const Bytes& source = block(get.from, get.source);
      get.data.assign(source.begin() + diff(get.offset), source.begin() + diff(get.offset + get.size));
    }
    std::stable_sort(gets_.begin(), gets_.end(), [](const Get& a, const Get& b) { return a.from < b.from; });
    for (const Get& get : gets_) write(block(get.by, get.target), get.target_offset, get.data);
    std::stable_sort(puts_.begin(), puts_.end(), [](const Put& a, const Put& b) { return a.from < b.from; });
    for (const Put& put : puts_) write(block(put.to, put.target), put.offset, put.data);
    gets_.clear();
    puts_.clear();
    for (std::size_t p = 0; p < inbox_.size(); ++p) {
      inbox_[p].clear();
      for (auto from = outbox_[p].rbegin(); from != outbox_[p].rend(); ++from)
        inbox_[p].insert(inbox_[p].end(), from->second.begin(), from->second.end());
      outbox_[p].clear();
    }
    effective_ = upcoming_;
    tag_size_ = next_tag_size_;
  }

 private:
  struct Put {
    int from, to, target;
    std::size_t offset;
    Bytes data;
  };
  struct Get {
    int by, from, source;
    std::size_t offset;
    int target;
    std::size_t target_offset, size;
    Bytes data;
  };

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static std::ptrdiff_t diff(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }
  static void write(Bytes& target, std::size_t offset, const Bytes& data) {
    std::copy(data.begin(), data.end(), target.begin() + diff(offset));
  }

  std::vector<std::vector<Bytes>> memory_;
  std::vector<Registration> effective_, upcoming_;
  std::vector<Put> puts_;
  std::vector<Get> gets_;
  std::vector<std::vector<Message>> inbox_;
  std::vector<std::map<int, std::vector<Message>>> outbox_;
  std::size_t tag_size_ = 0, next_tag_size_ = 0;
};

}  // namespace random_model
