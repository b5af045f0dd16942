/// Few: a short list without an allocation of its own, for the records that each robot has. Swarms
/// of a million have many such lists, and most of them hold an item or two.
#ifndef KILOTWIN_BASE_FEW_H
#define KILOTWIN_BASE_FEW_H

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>

namespace kilotwin {

/// A list whose first N items lie in the object itself; more are allocated. For lists that each
/// robot has and that are mostly short. Items are plain data: they are copied and dropped without
/// a call. At most 2^32 - 1 items. Pointers to items hold until the list grows or is moved.
template <typename T, uint32_t N> class Few {
    static_assert(N > 0 && std::is_trivially_copy_constructible_v<T> &&
                  std::is_trivially_destructible_v<T> && std::is_default_constructible_v<T>);

  public:
    using value_type = T;
    using iterator = T *;
    using const_iterator = const T *;

    /// Empty; allocates nothing.
    Few() : items_(own()) {}
    Few(const Few &other) : Few() { assign(other); }
    Few(Few &&other) noexcept : Few() { take(other); }
    Few &operator=(const Few &other) {
        if (this != &other) assign(other);
        return *this;
    }
    Few &operator=(Few &&other) noexcept {
        if (this != &other) {
            release();
            take(other);
        }
        return *this;
    }
    ~Few() { release(); }

    // Items lie side by side, in the order in which they were added.
    T *begin() { return items_; }
    const T *begin() const { return items_; }
    T *end() { return items_ + size_; }
    const T *end() const { return items_ + size_; }
    T *data() { return items_; }
    const T *data() const { return items_; }
    size_t size() const { return size_; }
    /// How many items it holds before it allocates again; N at first, never less than before.
    size_t capacity() const { return capacity_; }
    bool empty() const { return size_ == 0; }
    // Not checked: `i` is below size(), and front(), back() and pop_back() want an item.
    T &operator[](size_t i) { return items_[i]; }
    const T &operator[](size_t i) const { return items_[i]; }
    T &front() { return items_[0]; }
    const T &front() const { return items_[0]; }
    T &back() { return items_[size_ - 1]; }
    const T &back() const { return items_[size_ - 1]; }

    /// Keeps what was allocated.
    void clear() { size_ = 0; }

    /// Allocates for `count` items at once, if they do not fit.
    void reserve(size_t count) {
        if (count > capacity_) grow(static_cast<uint32_t>(count));
    }

    /// Items beyond the old size have no value yet.
    void resize(size_t count) {
        reserve(count);
        size_ = static_cast<uint32_t>(count);
    }

    /// Adds an item at the end; it may be one of the list's own.
    void push_back(T item) {
        make_room();
        std::construct_at(items_ + size_++, item);
    }

    /// Adds T(arguments...), which may not be taken from the list itself; returns it.
    template <typename... Arguments> T &emplace_back(Arguments &&...arguments) {
        make_room();
        return *std::construct_at(items_ + size_++, std::forward<Arguments>(arguments)...);
    }
    void pop_back() { size_--; }

    /// Puts an item before `place`; returns where it is.
    T *insert(const T *place, T item) {
        const ptrdiff_t index = place - items_;
        push_back(item);
        std::rotate(begin() + index, end() - 1, end());
        return begin() + index;
    }
    /// Removes the items from `first` to before `last`; returns where the next one is.
    T *erase(const T *first, const T *last) {
        T *const to = begin() + (first - items_);
        size_ -= static_cast<uint32_t>(last - first);
        std::copy(last, last + (end() - to), to);
        return to;
    }
    T *erase(const T *place) { return erase(place, place + 1); }

  private:
    T *own() { return reinterpret_cast<T *>(own_); }
    bool is_allocated() const { return items_ != reinterpret_cast<const T *>(own_); }
    /// For one item more. The room doubles, so that n items cost O(n).
    void make_room() {
        if (size_ == capacity_) grow(2 * capacity_);
    }
    void grow(uint32_t capacity) {
        T *const items = std::allocator<T>().allocate(capacity);
        std::uninitialized_copy(begin(), end(), items);
        if (is_allocated()) std::allocator<T>().deallocate(items_, capacity_);
        items_ = items;
        capacity_ = capacity;
    }
    /// Copies the items of another list.
    void assign(const Few &other) {
        clear();
        reserve(other.size_);
        std::uninitialized_copy(other.begin(), other.end(), items_);
        size_ = other.size_;
    }
    /// Gives back what was allocated, and is empty.
    void release() {
        if (is_allocated()) std::allocator<T>().deallocate(items_, capacity_);
        items_ = own();
        capacity_ = N;
        size_ = 0;
    }
    /// This list is empty and has allocated nothing; `other` becomes so.
    void take(Few &other) {
        if (!other.is_allocated()) {
            assign(other);
        } else {
            items_ = std::exchange(other.items_, other.own());
            capacity_ = std::exchange(other.capacity_, N);
            size_ = other.size_;
        }
        other.size_ = 0;
    }

    T *items_;
    uint32_t size_ = 0, capacity_ = N;
    alignas(T) std::byte own_[N * sizeof(T)];
};

}  // namespace kilotwin

#endif
