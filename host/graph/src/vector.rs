//! Vectors and matrices whose entries are nodes.

use nalgebra::{Matrix3, Vector3};

use super::graph::{Graph, Node};

/// Three nodes.
pub type V3 = [Node; 3];
/// Nine nodes, rows of three.
pub type M3 = [V3; 3];
/// Six nodes.
pub type V6 = [Node; 6];
/// Thirty-six nodes, rows of six.
pub type M6 = [V6; 6];

impl Graph {
    /// A constant vector.
    pub fn vector(&mut self, v: &Vector3<f64>) -> V3 {
        std::array::from_fn(|k| self.constant(v[k]))
    }

    /// A constant matrix.
    pub fn matrix(&mut self, m: &Matrix3<f64>) -> M3 {
        std::array::from_fn(|i| std::array::from_fn(|j| self.constant(m[(i, j)])))
    }

    /// Three consecutive inputs.
    pub fn input_vector(&mut self, slot: usize) -> V3 {
        std::array::from_fn(|k| self.input(slot + k))
    }

    /// a + b
    pub fn add3(&mut self, a: V3, b: V3) -> V3 {
        std::array::from_fn(|k| self.add(a[k], b[k]))
    }

    /// a - b
    pub fn sub3(&mut self, a: V3, b: V3) -> V3 {
        std::array::from_fn(|k| self.sub(a[k], b[k]))
    }

    /// -a
    pub fn neg3(&mut self, a: V3) -> V3 {
        a.map(|x| self.neg(x))
    }

    /// s a
    pub fn scale3(&mut self, s: Node, a: V3) -> V3 {
        a.map(|x| self.mul(s, x))
    }

    /// a . b
    pub fn dot3(&mut self, a: V3, b: V3) -> Node {
        let products: V3 = std::array::from_fn(|k| self.mul(a[k], b[k]));
        let partial = self.add(products[0], products[1]);
        self.add(partial, products[2])
    }

    /// a x b
    pub fn cross(&mut self, a: V3, b: V3) -> V3 {
        std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let left = self.mul(a[i], b[j]);
            let right = self.mul(a[j], b[i]);
            self.sub(left, right)
        })
    }

    /// M a
    pub fn apply(&mut self, m: &M3, a: V3) -> V3 {
        std::array::from_fn(|i| self.dot3(m[i], a))
    }

    /// M^T a
    pub fn apply_transposed(&mut self, m: &M3, a: V3) -> V3 {
        std::array::from_fn(|j| {
            let column = [m[0][j], m[1][j], m[2][j]];
            self.dot3(column, a)
        })
    }

    /// M N
    pub fn product(&mut self, m: &M3, n: &M3) -> M3 {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let column = [n[0][j], n[1][j], n[2][j]];
                self.dot3(m[i], column)
            })
        })
    }

    /// M v~, the columns of M crossed with a body-fixed vector: the rate of a rotation matrix.
    pub fn times_skew(&mut self, m: &M3, v: V3) -> M3 {
        // Row i of M v~ is m_i x v, since (m^T v~)^T = -v x m = m x v.
        std::array::from_fn(|i| self.cross(m[i], v))
    }

    /// a + b
    pub fn add6(&mut self, a: V6, b: V6) -> V6 {
        std::array::from_fn(|k| self.add(a[k], b[k]))
    }

    /// a . b
    pub fn dot6(&mut self, a: V6, b: V6) -> Node {
        let left = self.dot3([a[0], a[1], a[2]], [b[0], b[1], b[2]]);
        let right = self.dot3([a[3], a[4], a[5]], [b[3], b[4], b[5]]);
        self.add(left, right)
    }

    /// M a
    pub fn apply6(&mut self, m: &M6, a: V6) -> V6 {
        std::array::from_fn(|i| self.dot6(m[i], a))
    }

    /// M + N, both symmetric
    pub fn add_symmetric(&mut self, m: &M6, n: &M6) -> M6 {
        let mut sum = *m;
        for i in 0..6 {
            for j in 0..=i {
                sum[i][j] = self.add(m[i][j], n[i][j]);
                sum[j][i] = sum[i][j];
            }
        }
        sum
    }
}
