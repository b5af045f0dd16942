/// Shapes on the floor: discs, upright rectangles and simple polygons. Lengths in metres.
#ifndef KILOTWIN_PHYSICS_REGION_H
#define KILOTWIN_PHYSICS_REGION_H

#include <Eigen/Core>
#include <vector>

namespace kilotwin {

/// The shape of an arena, of an obstacle or of a site.
struct Region {
    /// Sides of a rectangle are parallel to the axes; a turned one is a polygon. PICTURE: a site
    /// painted in a picture of the floor; contains() is false everywhere, and it has no edge.
    enum class Shape { CIRCLE, RECTANGLE, POLYGON, PICTURE };
    Shape shape;
    Eigen::Vector2d centre;  ///< (0, 0) for a round or rectangular arena; a polygon's: of its box
    Eigen::Vector2d size;    ///< width and height; a circle's are both its diameter
    std::vector<Eigen::Vector2d> corners = {};  ///< of a polygon: at least 3, in either order

    /// A polygon without edges that cross or touch; centre and size are those of its box.
    static Region polygon(std::vector<Eigen::Vector2d> corners);

    /// The same turned by `heading_rad` about the origin, then moved by `by`. A rectangle that is
    /// turned is a polygon.
    Region placed(const Eigen::Vector2d &by, double heading_rad) const;

    /// Whether `point` lies inside or on the edge. Linear in corners; on a polygon's edge it may be
    /// either.
    bool contains(const Eigen::Vector2d &point) const;

    /// Distance from `point` to the edge, from either side; a lower bound off a rectangle's
    /// corners. Linear in corners.
    double distance_to_edge(const Eigen::Vector2d &point) const;

    /// Corners of a rectangle or polygon, counter-clockwise; neither twice the same nor one that
    /// lies on a straight edge. A circle has none.
    std::vector<Eigen::Vector2d> outline() const;
};

/// The z of the cross product: above 0 if `b` points to the left of `a`.
inline double cross(const Eigen::Vector2d &a, const Eigen::Vector2d &b) {
    return a.x() * b.y() - a.y() * b.x();
}

/// Distance from a point to the straight line between two others, its ends included.
double edge_distance(const Eigen::Vector2d &point, const Eigen::Vector2d &begin,
                     const Eigen::Vector2d &end);

}  // namespace kilotwin

#endif
