//! [`Split`]: complex vectors with real and imaginary parts apart, and what is summed over them.

use nalgebra::Complex;

/// Parts of sums.
const PARTS: usize = 4;

/// A complex vector, its real and its imaginary part.
#[derive(Debug, Clone)]
pub(super) struct Split {
    pub(super) re: Vec<f64>,
    pub(super) im: Vec<f64>,
}

impl Split {
    /// A vector that is like no other.
    pub(super) fn start(n: usize) -> Self {
        Self { re: (0..n).map(|k| ((k * 7919 + 13) % 101) as f64 / 101.0 + 0.1).collect(), im: vec![0.0; n] }
    }

    pub(super) fn with_capacity(n: usize) -> Self {
        Self { re: Vec::with_capacity(n), im: Vec::with_capacity(n) }
    }

    pub(super) fn clear(&mut self) {
        self.re.clear();
        self.im.clear();
    }

    pub(super) fn extend(&mut self, [re, im]: [&[f64]; 2]) {
        self.re.extend_from_slice(re);
        self.im.extend_from_slice(im);
    }

    pub(super) fn extend_real(&mut self, re: &[f64]) {
        self.re.extend_from_slice(re);
        self.im.resize(self.re.len(), 0.0);
    }

    pub(super) fn push(&mut self, value: Complex<f64>) {
        self.re.push(value.re);
        self.im.push(value.im);
    }

    pub(super) fn len(&self) -> usize {
        self.re.len()
    }

    pub(super) fn get(&self, k: usize) -> Complex<f64> {
        Complex::new(self.re[k], self.im[k])
    }

    pub(super) fn set(&mut self, k: usize, value: Complex<f64>) {
        (self.re[k], self.im[k]) = (value.re, value.im);
    }

    pub(super) fn swap(&mut self, a: usize, b: usize) {
        self.re.swap(a, b);
        self.im.swap(a, b);
    }

    pub(super) fn part(&self, k: usize) -> [&[f64]; 2] {
        [&self.re[k..], &self.im[k..]]
    }

    pub(super) fn part_mut(&mut self, k: usize) -> [&mut [f64]; 2] {
        [&mut self.re[k..], &mut self.im[k..]]
    }

    pub(super) fn conjugate(mut self) -> Self {
        self.im.iter_mut().for_each(|entry| *entry = -*entry);
        self
    }

    /// x^H y with another.
    pub(super) fn conjugate_product(&self, other: &Self) -> Complex<f64> {
        let ([re, from_im], [im, less]) = (dots(&self.re, other.part(0)), dots(&self.im, other.part(0)));
        Complex::new(re + less, from_im - im)
    }

    /// Makes its length one; gives what it was, `None` where that is zero or not finite.
    pub(super) fn normalise(&mut self) -> Option<f64> {
        let length = self.conjugate_product(self).re.sqrt();
        if !(length.is_finite() && length > 0.0) {
            return None;
        }
        self.re.iter_mut().chain(&mut self.im).for_each(|entry| *entry /= length);
        Some(length)
    }
}

/// y += factor x.
pub(super) fn add([y_re, y_im]: [&mut [f64]; 2], factor: Complex<f64>, [x_re, x_im]: [&[f64]; 2]) {
    for (((y_re, y_im), x_re), x_im) in y_re.iter_mut().zip(y_im).zip(x_re).zip(x_im) {
        *y_re += factor.re * x_re - factor.im * x_im;
        *y_im += factor.re * x_im + factor.im * x_re;
    }
}

/// The same for a vector that is real.
pub(super) fn add_real([y_re, y_im]: [&mut [f64]; 2], factor: Complex<f64>, x: &[f64]) {
    for ((y_re, y_im), x) in y_re.iter_mut().zip(y_im).zip(x) {
        *y_re += factor.re * x;
        *y_im += factor.im * x;
    }
}

/// y := factor y + x, for an x that is real.
pub(super) fn scale_and_add([y_re, y_im]: [&mut [f64]; 2], factor: Complex<f64>, x: &[f64]) {
    for ((y_re, y_im), x) in y_re.iter_mut().zip(y_im).zip(x) {
        let re = factor.re * *y_re - factor.im * *y_im + x;
        *y_im = factor.re * *y_im + factor.im * *y_re;
        *y_re = re;
    }
}

/// The sum of products a x.
pub(super) fn product(a: [&[f64]; 2], x: [&[f64]; 2]) -> Complex<f64> {
    let (mut re, mut im) = ([0.0; PARTS], [0.0; PARTS]);
    let [a, x] = [a, x].map(|both| both.map(|part| part.as_chunks::<PARTS>()));
    let parts = a[0].0.iter().zip(a[1].0).zip(x[0].0.iter().zip(x[1].0));
    for ((a_re, a_im), (x_re, x_im)) in parts {
        re = with_products(re, a_re, x_re, 1.0);
        re = with_products(re, a_im, x_im, -1.0);
        im = with_products(im, a_re, x_im, 1.0);
        im = with_products(im, a_im, x_re, 1.0);
    }
    let rest = a[0].1.iter().zip(a[1].1).zip(x[0].1.iter().zip(x[1].1));
    let rest = rest.map(|((a_re, a_im), (x_re, x_im))| Complex::new(*a_re, *a_im) * Complex::new(*x_re, *x_im));
    Complex::new(re.iter().sum::<f64>(), im.iter().sum::<f64>()) + rest.sum::<Complex<f64>>()
}

#[inline(always)]
fn with_products(sums: [f64; PARTS], a: &[f64; PARTS], b: &[f64; PARTS], sign: f64) -> [f64; PARTS] {
    std::array::from_fn(|k| sums[k] + sign * (a[k] * b[k]))
}

/// The sums of products of a real vector with both parts of another.
pub(super) fn dots(a: &[f64], x: [&[f64]; 2]) -> [f64; 2] {
    x.map(|x| {
        let mut sums = [0.0; PARTS];
        let (a, x) = (a.as_chunks::<PARTS>(), x.as_chunks::<PARTS>());
        for (a, x) in a.0.iter().zip(x.0) {
            sums = with_products(sums, a, x, 1.0);
        }
        sums.iter().sum::<f64>() + a.1.iter().zip(x.1).map(|(a, x)| a * x).sum::<f64>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_complex_numbers() {
        for n in 0..14 {
            let vector = |phase: f64| Split {
                re: (0..n).map(|k| (phase + k as f64).sin()).collect(),
                im: (0..n).map(|k| (2.0 * phase - k as f64).cos()).collect(),
            };
            let whole = |x: &Split| (0..n).map(|k| x.get(k)).collect::<Vec<_>>();
            let (a, x, factor) = (vector(1.0), vector(5.0), Complex::new(0.3, -1.7));
            let known = |f: fn(Complex<f64>, Complex<f64>) -> Complex<f64>| -> Complex<f64> {
                whole(&a).iter().zip(&whole(&x)).map(|(a, x)| f(*a, *x)).sum()
            };
            let near = |a: Complex<f64>, b: Complex<f64>| assert!((a - b).norm() < 1e-14, "{n}: {a} {b}");
            near(product(a.part(0), x.part(0)), known(|a, x| a * x));
            near(a.conjugate_product(&x), known(|a, x| a.conj() * x));
            let [re, im] = dots(&a.re, x.part(0));
            near(Complex::new(re, im), known(|a, x| x * a.re));
            let (mut added, mut with_real, mut scaled) = (x.clone(), x.clone(), x.clone());
            add(added.part_mut(0), factor, a.part(0));
            add_real(with_real.part_mut(0), factor, &a.re);
            scale_and_add(scaled.part_mut(0), factor, &a.re);
            for k in 0..n {
                near(added.get(k), x.get(k) + factor * a.get(k));
                near(with_real.get(k), x.get(k) + factor * a.re[k]);
                near(scaled.get(k), factor * x.get(k) + a.re[k]);
            }
        }
    }
}
