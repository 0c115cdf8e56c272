//! Surfaces and where rays meet them.

use glam::{DMat3, DVec3};

/// A half line; `direction` has length 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
}

impl Ray {
    fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray meets a surface first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Distance along the ray.
    pub(super) t: f64,
    /// Outward, length 1.
    pub(super) normal: DVec3,
    /// The point in the surface's own frame, for textures.
    pub(super) local: DVec3,
}

/// A shape in the world; z is up.
#[derive(Clone, Copy, Debug)]
pub(super) enum Surface {
    /// A level disk seen from above.
    Disk {
        centre: DVec3,
        radius: f64,
    },
    Sphere {
        centre: DVec3,
        radius: f64,
    },
    /// A box with half sides `half`, turned by `yaw` radians about z.
    Box {
        centre: DVec3,
        half: DVec3,
        yaw: f64,
    },
    /// A straight wire with rounded ends.
    Rod {
        from: DVec3,
        to: DVec3,
        radius: f64,
    },
    /// A level ring of wire: a torus.
    Ring {
        centre: DVec3,
        radius: f64,
        wire_radius: f64,
    },
}

impl Surface {
    /// The first meeting with the ray in front of its origin; rays start outside all surfaces.
    pub(super) fn hit(&self, ray: &Ray) -> Option<Hit> {
        match *self {
            Self::Disk { centre, radius } => {
                let t = (centre.z - ray.origin.z) / ray.direction.z;
                let local = ray.at(t) - centre;
                (t > 0.0 && local.length_squared() <= radius * radius).then_some(Hit { t, normal: DVec3::Z, local })
            }
            Self::Sphere { centre, radius } => {
                let t = sphere_entry(ray, centre, radius)?;
                let normal = (ray.at(t) - centre) / radius;
                Some(Hit { t, normal, local: normal })
            }
            Self::Box { centre, half, yaw } => {
                let to_world = DMat3::from_rotation_z(yaw);
                let to_local = to_world.transpose();
                let (origin, direction) = (to_local * (ray.origin - centre), to_local * ray.direction);
                let (a, b) = ((-half - origin) / direction, (half - origin) / direction);
                let (near, far) = (a.min(b), a.max(b));
                let t = near.max_element();
                if t <= 0.0 || t > far.min_element() {
                    return None;
                }
                let axis = DVec3::AXES.into_iter().zip(near.to_array()).find(|&(_, n)| n == t)?.0;
                let normal = to_world * (axis * -direction.dot(axis).signum());
                Some(Hit { t, normal, local: (origin + direction * t) / half })
            }
            Self::Rod { from, to, radius } => rod_hit(ray, from, to, radius),
            Self::Ring { centre, radius, wire_radius } => ring_hit(ray, centre, radius, wire_radius),
        }
    }
}

/// Distance at which the ray enters a sphere ahead of it.
fn sphere_entry(ray: &Ray, centre: DVec3, radius: f64) -> Option<f64> {
    let to_origin = ray.origin - centre;
    let b = to_origin.dot(ray.direction);
    let discriminant = b * b - (to_origin.length_squared() - radius * radius);
    if discriminant < 0.0 {
        return None;
    }
    let t = -b - discriminant.sqrt();
    (t > 0.0).then_some(t)
}

fn rod_hit(ray: &Ray, from: DVec3, to: DVec3, radius: f64) -> Option<Hit> {
    let length = from.distance(to);
    let axis = (to - from) / length;
    // The part of the ray across the axis meets a circle.
    let across = |v: DVec3| v - axis * v.dot(axis);
    let (o, d) = (across(ray.origin - from), across(ray.direction));
    let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - radius * radius);
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let on_side = (-b - discriminant.sqrt()) / a;
    let height = (ray.at(on_side) - from).dot(axis);
    let (t, core) = if (0.0..=length).contains(&height) {
        (on_side, from + axis * height)
    } else {
        let end = if height < 0.0 { from } else { to };
        (sphere_entry(ray, end, radius)?, end)
    };
    (t > 0.0).then(|| Hit { t, normal: (ray.at(t) - core) / radius, local: ray.at(t) })
}

fn ring_hit(ray: &Ray, centre: DVec3, radius: f64, wire_radius: f64) -> Option<Hit> {
    // The wire lies between two planes, so only a short piece of the ray can meet it.
    let a = (centre.z - wire_radius - ray.origin.z) / ray.direction.z;
    let b = (centre.z + wire_radius - ray.origin.z) / ray.direction.z;
    let (mut t, end) = (a.min(b).max(0.0), a.max(b));
    // From there on, steps by the distance to the wire's surface never pass it.
    for _ in 0..128 {
        if t > end {
            return None;
        }
        let p = ray.at(t) - centre;
        let core = DVec3::new(p.x, p.y, 0.0).normalize_or_zero() * radius;
        let distance = p.distance(core) - wire_radius;
        if distance < 1e-6 {
            return Some(Hit { t, normal: (p - core).normalize_or_zero(), local: p });
        }
        t += distance;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const SURFACES: [Surface; 5] = [
        Surface::Disk { centre: DVec3::new(0.1, 0.2, -0.3), radius: 0.9 },
        Surface::Sphere { centre: DVec3::new(0.1, 0.2, 0.3), radius: 0.5 },
        Surface::Box { centre: DVec3::new(0.1, -0.2, 0.0), half: DVec3::new(0.3, 0.4, 0.5), yaw: 0.7 },
        Surface::Rod { from: DVec3::new(-0.5, 0.1, 0.0), to: DVec3::new(0.4, 0.0, 0.6), radius: 0.2 },
        Surface::Ring { centre: DVec3::new(0.0, 0.1, 0.2), radius: 0.7, wire_radius: 0.1 },
    ];

    /// How far `p` is outside the surface; 0 on it.
    fn distance(surface: &Surface, p: DVec3) -> f64 {
        match *surface {
            Surface::Disk { centre, .. } => p.z - centre.z,
            Surface::Sphere { centre, radius } => p.distance(centre) - radius,
            Surface::Box { centre, half, yaw } => {
                ((DMat3::from_rotation_z(-yaw) * (p - centre)).abs() - half).max_element()
            }
            Surface::Rod { from, to, radius } => {
                let h = ((p - from).dot(to - from) / from.distance_squared(to)).clamp(0.0, 1.0);
                p.distance(from.lerp(to, h)) - radius
            }
            Surface::Ring { centre, radius, wire_radius } => {
                let q = p - centre;
                (q.x.hypot(q.y) - radius).hypot(q.z) - wire_radius
            }
        }
    }

    #[test]
    fn hits_lie_on_the_surface_first_met_with_normals_against_the_ray() {
        for surface in &SURFACES {
            let mut n_hits = 0;
            for i in 0..2000 {
                // Rays from a sphere of radius 4 above the ground towards points near the origin.
                let (sin, cos) = (f64::from(i) * 2.4).sin_cos();
                let z = 0.05 + 0.9 * f64::from(i) / 2000.0;
                let origin = 4.0 * DVec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
                let target = DVec3::new((f64::from(i) * 0.7).sin(), (f64::from(i) * 1.3).cos(), 0.3 * sin);
                let ray = Ray { origin, direction: (target - origin).normalize() };
                let Some(hit) = surface.hit(&ray) else { continue };
                n_hits += 1;
                assert!(distance(surface, ray.at(hit.t)).abs() < 1e-5, "{surface:?} is not met at {}", ray.at(hit.t));
                assert!(hit.normal.is_normalized(), "{surface:?} normal {}", hit.normal);
                assert!(hit.normal.dot(ray.direction) <= 1e-3, "{surface:?} is met from inside");
                for step in 1..200 {
                    let before = ray.at(hit.t * f64::from(step) / 200.0);
                    assert!(distance(surface, before) > -1e-5, "{surface:?} is met earlier, at {before}");
                }
            }
            assert!(n_hits > 50, "{surface:?} is met by {n_hits} rays");
        }
    }
}
