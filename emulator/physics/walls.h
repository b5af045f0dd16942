/// Walls of any shape: the outline of the arena, seen from inside, and obstacles, seen from
/// outside. Lengths in metres.
///
/// A wall is a feature: a straight piece, a corner that sticks out, or a round wall. Each has a
/// nearest point and a normal, so that a robot at one of them is in closed form
/// (contact/closed_form.h). To either of two straight pieces that meet in a nook the other one does
/// not matter; a piece that ends at a corner that sticks out hands over to the corner.
///
/// A grid of squares, made once, lists the features near each square: looking up the walls near a
/// point takes constant time, however many there are.
#ifndef KILOTWIN_PHYSICS_WALLS_H
#define KILOTWIN_PHYSICS_WALLS_H

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/region.h"

namespace kilotwin {

/// Something solid that stands in the arena, or reaches into it. Obstacles may overlap.
struct Obstacle {
    Region shape;
    bool blocks_light;  ///< whether infrared messages and lamps stop at it
};

class Walls {
  public:
    /// None.
    Walls() = default;

    /// Walls of an arena and of what stands in it. `bounds_block_light`: whether the arena's own
    /// do. Those within `reach_m` (above 0) of a point are found in constant time, farther ones in
    /// O(walls). Takes O(walls * squares), of which there are at most 66,000.
    Walls(const Region &bounds, bool bounds_block_light, const std::vector<Obstacle> &obstacles,
          double reach_m);

    bool empty() const { return features_.empty(); }

    /// Distance of `point` from the nearest wall, below 0 inside what is solid. Exact up to the
    /// reach, a lower bound beyond it.
    double gap(const Eigen::Vector2d &point) const;

    /// Calls `visit(gap, outward, wall)` for each wall within `reach_m` of a point, by ascending
    /// number: its distance, the unit vector towards its nearest point, and its number. Inside what
    /// is solid there is one wall, the nearest, and its gap is below 0.
    template <typename Visit>
    void for_each(const Eigen::Vector2d &point, double reach_m, Visit visit) const {
        const auto list = near(point, reach_m);
        const Nearest nearest = nearest_of(list, point);
        if (nearest.gap_m < 0) {
            visit(nearest.gap_m, features_[nearest.wall].outward(point), nearest.wall);
            return;
        }
        for (uint32_t wall : list) {
            const Feature &feature = features_[wall];
            const double gap_m = feature.reached(point, reach_m);
            if (gap_m <= reach_m) visit(gap_m, feature.outward(point), wall);
        }
    }

    /// Whether no wall that blocks light lies between two points. Takes time by their distance.
    bool lets_light_pass(const Eigen::Vector2d &from, const Eigen::Vector2d &to) const;

  private:
    struct Feature {
        /// PIECE: straight. CORNER: where two of them meet. HALL: round, seen from inside. PILLAR:
        /// round, seen from outside.
        enum class Kind : uint8_t { PIECE, CORNER, HALL, PILLAR };
        Kind kind;
        bool blocks_light;
        /// CORNER: robots go around it. A corner that is none of those is a nook.
        bool sticks_out = false;
        Eigen::Vector2d at;            ///< begin, corner or middle
        double size_m = 0;             ///< PIECE: length; HALL, PILLAR: radius
        Eigen::Vector2d along{0, 0};   ///< unit vectors of a PIECE; of the piece that ends at a
        Eigen::Vector2d beyond{0, 0};  ///< CORNER, and of the one that begins there
        bool begins_in_nook = false, ends_in_nook = false;  ///< PIECE
        Eigen::Vector2d before{0, 0}, after{0, 0};          ///< PIECE: the adjacent pieces' normals

        /// PIECE: unit vector to its left, where robots are.
        Eigen::Vector2d normal() const { return {-along.y(), along.x()}; }
        /// Distance, below 0 from its solid side; infinite where a neighbour is nearer for certain.
        double gap(const Eigen::Vector2d &point) const;
        /// The same for a wall that a robot may come to from `point` within `reach_m`, else
        /// infinite.
        double reached(const Eigen::Vector2d &point, double reach_m) const;
        /// Unit vector into the wall at its nearest point.
        Eigen::Vector2d outward(const Eigen::Vector2d &point) const;
        /// Distance from either side, also off its ends.
        double distance(const Eigen::Vector2d &point) const;
        bool is_crossed(const Eigen::Vector2d &from, const Eigen::Vector2d &to) const;
    };

    /// A square of the grid: nearby_[first] and so on are within reach_m_ of a point in it.
    struct Square {
        uint32_t first, count;
        double gap_m;  ///< of its middle, below 0 in what is solid
    };

    struct Nearest {
        double gap_m = INFINITY;
        uint32_t wall = 0;
    };

    void add_outline(std::vector<Eigen::Vector2d> corners, bool blocks_light);
    void make_grid(const Region &bounds, const std::vector<Obstacle> &obstacles);
    Nearest nearest_of(std::span<const uint32_t> list, const Eigen::Vector2d &point) const;
    const Square *square_at(const Eigen::Vector2d &point) const;
    Eigen::Vector2d middle_of(const Square &square) const;
    std::span<const uint32_t> near(const Eigen::Vector2d &point, double reach_m) const;

    std::vector<Feature> features_;
    std::vector<uint32_t> all_;  ///< numbers of all features
    double reach_m_ = 0;
    Eigen::Vector2d low_{0, 0};  ///< of the grid
    double side_m_ = 0;          ///< of a square: all of it is within reach_m_ of its middle
    int columns_ = 0, rows_ = 0;
    std::vector<Square> squares_;  ///< row by row
    std::vector<uint32_t> nearby_;
};

}  // namespace kilotwin

#endif
