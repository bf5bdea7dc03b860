# What the statistics of studies are compared with: Rscript statistics.R > expected.json, beside people.csv.
# R 4.2.2 with car 3.1, lmerTest 3.1, ordinal 2022.11, emmeans 1.8 and jsonlite (Debian 12).
suppressPackageStartupMessages({library(car); library(lmerTest); library(ordinal)})
people <- read.csv("people.csv")
people$a <- factor(people$assistance, levels = c("none", "highlight", "optimal"))
people$b <- factor(people$objects)
contrasts(people$a) <- contr.sum(3)
contrasts(people$b) <- contr.sum(3)
six <- droplevels(subset(people, objects == 6))
contrasts(six$a) <- contr.sum(3)
root <- function(f, low, high) uniroot(f, c(low, high), tol = 1e-14, maxiter = 1000)$root
f_test <- function(f, df1, df2) list(statistic = f, df1 = df1, df2 = df2, p = pf(f, df1, df2, lower.tail = FALSE))
rows <- function(table, names) lapply(setNames(names, c("assistance", "objects", "interaction")[seq_along(names)]),
  function(n) f_test(table[n, grep("^F", colnames(table))], table[n, "Df"], table["Residuals", "Df"]))
effects <- c("a", "b", "a:b")
out <- list()

# One factor.
one <- oneway.test(y ~ a, six, var.equal = TRUE)
welch <- oneway.test(y ~ a, six)
out$one_way <- f_test(one$statistic[[1]], one$parameter[[1]], one$parameter[[2]])
out$welch <- f_test(welch$statistic[[1]], welch$parameter[[1]], welch$parameter[[2]])
spread_test <- function(y, cell) {  # Hines and Hines 2000: ordered deviations turned in the plane of the middle pair
  parts <- lapply(split(y, cell), function(v) {
    z <- sort(v - median(v)); k <- length(z) %/% 2
    if (length(z) %% 2 == 0) z[k:(k + 1)] <- c(1, -1) / sqrt(2) * z[k] + c(1, 1) / sqrt(2) * z[k + 1]
    abs(z[-(if (length(z) %% 2) k + 1 else k)])
  })
  found <- anova(lm(z ~ g, data.frame(z = unlist(parts), g = rep(factor(seq_along(parts)), lengths(parts)))))
  f_test(found[1, "F value"], found[1, "Df"], found[2, "Df"])
}
out$brown_forsythe <- spread_test(six$y, six$a)
hc <- Anova(lm(y ~ a, six), type = 3, white.adjust = "hc3")
out$hc3_one_way <- f_test(hc["a", "F"], hc["a", "Df"], hc["Residuals", "Df"])
n <- nrow(six)
below <- function(f, df1, df2, l) {  # pf(ncp = l) is good to 1e-9 only
  k <- 0:3000
  sum(dpois(k, l / 2) * pbeta(df1 * f / (df1 * f + df2), df1 / 2 + k, df2 / 2))
}
ends <- sapply(c(.95, .05), function(s) {
  g <- function(l) below(one$statistic[[1]], one$parameter[[1]], one$parameter[[2]], l) - s
  if (g(0) < 0) 0 else root(g, 0, 200)
})
out$eta_interval <- ends / (ends + n)
out$eta_equivalence_p <- below(one$statistic[[1]], one$parameter[[1]], one$parameter[[2]], n * .06 / .94)
power <- function(eta) 1 - below(qf(.95, 2, n - 3), 2, n - 3, n * eta / (1 - eta))
out$detectable <- root(function(e) power(e) - .8, 1e-6, .9)
out$mean_intervals <- lapply(split(six$y, six$a), function(v) as.numeric(t.test(v)$conf.int))

# Two factors.
fit <- lm(y ~ a * b, people)
out$type_2 <- rows(Anova(fit, type = 2), effects)
out$type_3 <- rows(Anova(fit, type = 3), effects)
out$hc3 <- rows(Anova(fit, type = 3, white.adjust = "hc3"), effects)
cells <- expand.grid(a = levels(people$a), b = levels(people$b))
values <- Map(function(a, b) people$y[people$a == a & people$b == b], cells$a, cells$b)
means <- sapply(values, mean); sizes <- sapply(values, length)
spread <- diag(sapply(values, var) / sizes)
johansen <- function(C) {  # Johansen 1980, as in Keselman, Wilcox and Lix 2003, doi:10.1111/1469-8986.00060
  inner <- solve(C %*% spread %*% t(C))
  t_wj <- (t(C %*% means) %*% inner %*% (C %*% means))[1]
  A <- .5 * sum(sapply(seq_along(sizes), function(j) {
    Q <- diag(as.numeric(seq_along(sizes) == j))
    M <- spread %*% t(C) %*% inner %*% C %*% Q
    (sum(diag(M %*% M)) + sum(diag(M))^2) / (sizes[j] - 1)
  }))
  q <- nrow(C)
  f_test(t_wj / (q + 2 * A - 6 * A / (q + 2)), q, q * (q + 2) / (3 * A))
}
steps <- rbind(c(1, -1, 0), c(0, 1, -1)); mean_of <- matrix(1 / 3, 1, 3)
out$welch_james <- list(assistance = johansen(kronecker(mean_of, steps)), objects = johansen(kronecker(steps, mean_of)),
  interaction = johansen(kronecker(steps, steps)))

# Diagnostics of the residuals.
left <- residuals(fit)
shapiro <- shapiro.test(left)
m <- function(k) mean((left - mean(left))^k)
cell <- interaction(people$a, people$b)
out$diagnostics <- list(shapiro_wilk = shapiro$statistic[[1]], shapiro_wilk_p = shapiro$p.value,
  skewness = m(3) / m(2)^1.5, kurtosis = m(4) / m(2)^2 - 3,
  equal_variances = spread_test(people$y, cell),
  largest = max(tapply(people$y, cell, sd)), smallest = min(tapply(people$y, cell, sd)))

# Pairs.
groups <- split(six$y, six$a)
df <- n - 3
pooled <- sqrt(sum(sapply(groups, function(v) sum((v - mean(v))^2))) / df)
q95 <- root(function(q) ptukey(q, 3, df) - .95, 1, 10)
names_of <- combn(names(groups), 2, simplify = FALSE)
raw <- sapply(names_of, function(p) t.test(groups[[p[2]]], groups[[p[1]]])$p.value)
corrected <- p.adjust(raw, "holm")
out$pairs <- lapply(seq_along(names_of), function(k) {
  x <- groups[[names_of[[k]][1]]]; y <- groups[[names_of[[k]][2]]]
  gap <- mean(y) - mean(x); error <- pooled * sqrt(1 / length(x) + 1 / length(y))
  w <- t.test(y, x); bound <- .5 * pooled
  sides <- c(t.test(y, x, mu = -bound, alternative = "greater")$p.value, t.test(y, x, mu = bound, alternative = "less")$p.value)
  both <- length(x) + length(y) - 2
  sp <- sqrt(((length(x) - 1) * var(x) + (length(y) - 1) * var(y)) / both)
  J <- exp(lgamma(both / 2) - lgamma((both - 1) / 2)) / sqrt(both / 2)
  scale <- sqrt(1 / length(x) + 1 / length(y)); t <- gap / sp / scale
  ncp <- sapply(c(.975, .025), function(s) root(function(l) pt(t, both, ncp = l) - s, t - 8, t + 8))
  list(difference = gap, interval = gap + c(-1, 1) * q95 / sqrt(2) * error,
    tukey_p = ptukey(abs(gap) / error * sqrt(2), 3, df, lower.tail = FALSE),
    games_howell_p = ptukey(abs(w$statistic[[1]]) * sqrt(2), 3, w$parameter[[1]], lower.tail = FALSE),
    holm_p = corrected[k], g = gap / sp * J, g_interval = ncp * scale * J, equivalence_p = max(sides))
})

# Proportional odds of answers.
six$answer <- factor(six$answer)
control <- clm.control(gradTol = 1e-13, maxIter = 500L)
odds <- clm(answer ~ a, data = six, contrasts = list(a = "contr.treatment"), control = control)
null <- clm(answer ~ 1, data = six, control = control)
gain <- 2 * as.numeric(logLik(odds) - logLik(null))
out$ordinal <- list(statistic = gain, df = 2, p = pchisq(gain, 2, lower.tail = FALSE), ratios = exp(as.numeric(odds$beta)))

# Houses as a random factor.
tight <- lmerControl(optimizer = "bobyqa", optCtrl = list(rhobeg = .2, rhoend = 1e-12, maxfun = 1e5))
mixed <- lmer(y ~ a * b + (1 | house), people, control = tight)
table <- anova(mixed, type = 3, ddf = "Satterthwaite")
# lmerTest's degrees of freedom are good to 1e-4 only: it differentiates where lmer stopped. At the maximum itself:
X <- model.matrix(~ a * b, people); Z <- model.matrix(~ 0 + house, people); y <- people$y
V <- function(v) v[1] * tcrossprod(Z) + v[2] * diag(nrow(X))
covariance <- function(v) solve(t(X) %*% solve(V(v)) %*% X)
deviance <- function(v) {
  left <- y - X %*% (covariance(v) %*% t(X) %*% solve(V(v), y))
  c(determinant(V(v))$modulus - determinant(covariance(v))$modulus + t(left) %*% solve(V(v), left))
}
v <- as.data.frame(VarCorr(mixed))$vcov
for (i in 1:5) v <- v - solve(numDeriv::hessian(deviance, v), numDeriv::grad(deviance, v))
of_variances <- 2 * solve(numDeriv::hessian(deviance, v))
slopes <- numDeriv::jacobian(function(v) c(covariance(v)), v)
freedom <- function(places) {  # Fai and Cornelius 1996
  L <- diag(ncol(X))[places, ]
  e <- eigen(L %*% covariance(v) %*% t(L))
  nu <- apply(t(e$vectors) %*% L, 1, function(l) {
    g <- apply(slopes, 2, function(s) c(t(l) %*% matrix(s, ncol(X)) %*% l))
    2 * c(t(l) %*% covariance(v) %*% l)^2 / c(t(g) %*% of_variances %*% g)
  })
  E <- sum(nu / (nu - 2))
  2 * E / (E - length(nu))
}
out$mixed <- lapply(list(assistance = c("a", 2, 3), objects = c("b", 4, 5), interaction = c("a:b", 6, 9)), function(n) {
  df2 <- freedom(as.numeric(n[2]):as.numeric(n[3]))
  stopifnot(abs(df2 / table[n[1], "DenDF"] - 1) < 1e-3)
  f_test(table[n[1], "F value"], table[n[1], "NumDF"], df2)
})
out$mixed_variances <- as.data.frame(VarCorr(mixed))$vcov

# Crossed random factors: people with four trials each, in twenty houses.
crossed <- read.csv("crossed.csv")
crossed$a <- factor(crossed$assistance)
contrasts(crossed$a) <- contr.sum(3)
crossed$pair <- interaction(crossed$house, crossed$a)
crossed_fit <- lmer(y ~ a + (1 | person) + (1 | house) + (1 | pair) + (1 | trial_number), crossed, control = tight)
table <- anova(crossed_fit, type = 3, ddf = "Satterthwaite")
out$crossed <- f_test(table["a", "F value"], table["a", "NumDF"], table["a", "DenDF"])
components <- as.data.frame(VarCorr(crossed_fit))
out$crossed_variances <- as.list(setNames(components$vcov, components$grp))

# Kinds of people: mixtures of beta-binomials, without the number of orders of the visits.
loss <- function(par, k) {
  w <- exp(c(par[seq_len(k - 1)], 0)); w <- w / sum(w)
  mean <- plogis(par[k - 1 + 1:k]); size <- exp(par[2 * k - 1 + 1:k])
  each <- sapply(1:k, function(j) log(w[j]) + lbeta(people$accepted + mean[j] * size[j],
    people$visits - people$accepted + (1 - mean[j]) * size[j]) - lbeta(mean[j] * size[j], (1 - mean[j]) * size[j]))
  -sum(log(rowSums(exp(each))))
}
climb <- function(par, k) {
  for (i in 1:5) par <- optim(par, loss, k = k, method = "BFGS", control = list(reltol = 1e-16, maxit = 5000))$par
  -loss(par, k)
}
out$mixtures <- c(climb(c(0, 1), 1), climb(c(0, qlogis(c(.3, .9)), 2, 3), 2))

# The score's trend, one-sided, and its order of means over all numbers of objects, each of the same weight.
line <- summary(lm(y ~ objects, subset(people, assistance == "none")))$coefficients["objects", ]
out$trend_p <- pt(line[["t value"]], sum(people$assistance == "none") - 2, lower.tail = FALSE)
weighted <- as.data.frame(summary(pairs(emmeans::emmeans(fit, "a"), adjust = "tukey")))
out$below_p <- weighted$p.value
out$below_difference <- weighted$estimate
cat(jsonlite::toJSON(out, digits = NA, auto_unbox = TRUE, pretty = TRUE), "\n")
